"""What `new` writes: a working robot, study or family to start from."""
