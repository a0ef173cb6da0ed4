"""What is said and drawn of a camera's diagnosis."""
