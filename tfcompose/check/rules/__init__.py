"""The rules, one a file; ``tfcompose.check.check`` lists them."""
