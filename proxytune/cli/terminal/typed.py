"""The command as it was typed."""

import argparse
import shlex


def typed(arguments: argparse.Namespace) -> str:
    """What repeats the command in a shell; "" where it was not typed but called."""
    words = [word for word in getattr(arguments, "words", ()) if word != "--json"]
    return shlex.join(["python", "-m", "proxytune", *words]) if words else ""
