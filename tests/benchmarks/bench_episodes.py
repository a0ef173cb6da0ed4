"""What an episode costs: `python -m pytest tests/benchmarks --benchmark-only --ignore-glob= -c /dev/null`."""
