"""An episode to look at: a still picture, an animation, and what is said of it."""
