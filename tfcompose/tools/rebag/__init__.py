"""Corrected recordings: bags rewritten with the poses of a robot file."""
