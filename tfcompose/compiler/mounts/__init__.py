"""Mounts: poses of frames at joint positions, and edits that give a mount a new pose."""
