"""A comparison of engines: JSON, tables and the figure."""
