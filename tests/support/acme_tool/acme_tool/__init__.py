"""Beepers on robots."""
