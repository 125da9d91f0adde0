"""Correction of recordings: rewriting a bag with the poses of a robot file."""
