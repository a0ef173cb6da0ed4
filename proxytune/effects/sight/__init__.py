"""Effects on the camera and on its pictures."""
