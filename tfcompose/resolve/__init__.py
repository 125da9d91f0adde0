"""Stage ``resolve``: a RobotSpec becomes a Robot with presets expanded, poses solved and owners given."""
