"""What frames show, and where they were taken."""
