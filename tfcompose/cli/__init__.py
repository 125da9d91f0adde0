"""The command line: the only part that reads, writes, prints and exits."""
