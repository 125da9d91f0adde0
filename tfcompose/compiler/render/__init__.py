"""Text output of commands: findings for people and programs, trees, and poses."""
