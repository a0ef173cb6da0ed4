"""What no name explains, learnt as curves."""
