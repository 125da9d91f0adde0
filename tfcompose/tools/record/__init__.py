"""Recordings of running robots."""
