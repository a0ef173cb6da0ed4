"""Several domain families compared: JSON, tables, the figure and the page."""
