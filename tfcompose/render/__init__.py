"""What commands print: findings for people and for programs, a robot's tree, and poses."""
