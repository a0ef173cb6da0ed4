"""What happens to a study in turn: pre-flight, cutting trials off, stopping, confirmation."""
