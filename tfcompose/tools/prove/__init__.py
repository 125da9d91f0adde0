"""Comparison of declared mounts with measurements of sensors."""
