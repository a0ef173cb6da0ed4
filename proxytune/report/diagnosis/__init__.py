"""A diagnosis: JSON, notes and figures."""
