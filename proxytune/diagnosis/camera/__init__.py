"""What a log's frames say of the camera."""
