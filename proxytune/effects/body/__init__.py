"""Effects on how the body moves, and on how its pose is measured."""
