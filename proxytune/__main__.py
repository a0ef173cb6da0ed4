"""`python -m proxytune`."""

import sys

if __name__ == "__main__":
    try:
        from proxytune.cli.main import main

        status = main()
    except KeyboardInterrupt:
        # While the libraries are loaded nothing has begun.
        print("proxytune: interrupted", file=sys.stderr)
        status = 130
    raise SystemExit(status)
