"""The model of a diagnosis: replayed over drives, its parameters fitted, their intervals."""
