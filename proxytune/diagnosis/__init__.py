"""Closing the loop: from measured logs to the effect that a model lacks."""
