"""A study: settings, episodes in parallel, the database that remembers them, and the loop."""
