"""Progress of a command whose length is not known: a spinner on a terminal, elsewhere a line for whatever is done."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from proxytune.running import Lines


@contextmanager
def waiting(what: str) -> Iterator[Callable[[str], None]]:
    """Show what is being done; gives what hears how far it is."""
    lines = Lines()
    with lines.console.status(what) as status:

        def tell(line: str) -> None:
            lines.say(line)
            status.update(line)

        yield tell
