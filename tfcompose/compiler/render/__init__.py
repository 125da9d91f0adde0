"""Text output of commands: findings for people and for programs, trees, and poses."""
