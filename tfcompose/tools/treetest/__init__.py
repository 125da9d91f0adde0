"""Tests of a robot's transform tree: cases in YAML, judged on started or recorded robots."""

#: The end of the names of test files.
ENDINGS = (".test.yaml", ".test.yml")
