"""Declared mounts against what sensors measure."""
