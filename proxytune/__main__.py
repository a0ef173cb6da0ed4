"""`python -m proxytune`."""

import sys

try:
    from proxytune.cli.main import main
except KeyboardInterrupt:
    # While the libraries are loaded nothing has begun.
    print("proxytune: interrupted", file=sys.stderr)
    raise SystemExit(130) from None

if __name__ == "__main__":
    raise SystemExit(main())
