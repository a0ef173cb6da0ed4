"""Bags, CSV files, trajectories and arrays of others, made a log."""
