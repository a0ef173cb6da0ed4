"""Learning value: JSON, tables and figures."""
