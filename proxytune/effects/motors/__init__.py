"""Effects between a command and the speed of a wheel."""
