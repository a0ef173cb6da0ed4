"""Learning from a proxy: demonstrations, learners, learning curves, and what a proxy is worth as a teacher (PLV)."""
