"""A watcher that interrupts, and what nothing catches."""

from proxytune.running import Silent


class Killed(BaseException):
    """As a signal that nothing can catch."""


class Stopping(Silent):
    """Presses Ctrl-C after so many episodes, or before what is announced so; counts what is announced as known."""

    def __init__(self, episodes=10**6, before="nothing"):
        self.left, self.before, self.off = episodes, before, 0

    def begin(self, what, known):
        self.off += known
        if what.startswith(self.before):
            raise KeyboardInterrupt

    def episode(self):
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt
