"""What starts a plan, keeps it going and ends it: the supervisor, what it knows, and what it tells."""
