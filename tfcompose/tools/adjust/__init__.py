"""Adjusted mounts: nudges of the running robot, calibrations, and the overlays that keep them."""
