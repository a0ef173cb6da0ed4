"""A sweep: JSON, CSV, tables and figures."""
