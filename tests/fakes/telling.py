"""A watcher that keeps every line it is told."""

from proxytune.running import Silent


class Telling(Silent):
    """Keeps what is told of everything finished."""

    def __init__(self):
        self.lines = []

    def finished(self, what):
        self.lines.append(what)
