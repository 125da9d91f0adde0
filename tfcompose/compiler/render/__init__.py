"""Makes text of what commands print.

Findings for people and programs, a robot's tree, and poses.
"""
