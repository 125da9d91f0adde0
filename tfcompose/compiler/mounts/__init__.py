"""Mounts: frames' poses at joint positions, and edits of the file for a new pose."""
