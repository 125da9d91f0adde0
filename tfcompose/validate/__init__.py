"""Stage ``validate``: a Source becomes a typed RobotSpec."""
