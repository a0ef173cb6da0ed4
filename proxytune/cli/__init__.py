"""The command line: one module per command, or function in `tasks`; `commands.toml` says which."""
