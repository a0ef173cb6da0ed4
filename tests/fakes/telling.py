"""A watcher that keeps every line it is told."""

from proxytune.running import Silent


class Telling(Silent):
    """Keeps what is told of everything finished, and what is begun."""

    def __init__(self):
        self.lines, self.begun = [], []

    def begin(self, what, known):
        self.begun.append(what)

    def finished(self, what):
        self.lines.append(what)
