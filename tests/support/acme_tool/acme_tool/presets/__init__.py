"""Presets of Acme's sensors."""
