"""A study: JSON, tables, figures and the page."""
