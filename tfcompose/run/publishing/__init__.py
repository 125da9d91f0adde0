"""tfcompose's own publishers: fixed edges, moving joints, stand-ins, and the robot's description."""
