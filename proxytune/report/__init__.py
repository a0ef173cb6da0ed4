"""What is found, for people: figures, tables, pages and JSON documents."""
