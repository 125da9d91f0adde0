"""What watches the live tree: who publishes which edge, and whether that is what the plan says."""
