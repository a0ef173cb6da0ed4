"""The road: maps, lanes, and how they are drawn."""
