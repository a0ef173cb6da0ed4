"""The camera, the tape, the map and the poses, fitted together; and the pictures of a fitted camera."""
