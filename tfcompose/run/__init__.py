"""What runs on the robot: supervisor, publishers and guard. It knows the plan, not the compiler."""
