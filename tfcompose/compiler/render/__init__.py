"""Makes text of what commands print: findings for people and programs, a robot's tree, and poses."""
