"""The command line: the only part that reads, writes, prints and exits."""

from tfcompose.cli.parser import main

__all__ = ["main"]
