"""Gymnasium both ways: lane following as an environment, and any environment as a domain family."""
