"""Errors on frames that were not fitted."""
