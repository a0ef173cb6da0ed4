"""`python -m proxytune`."""

from proxytune.cli.main import main

if __name__ == "__main__":
    raise SystemExit(main())
