"""A watcher that interrupts."""

from proxytune.running import Silent


class Stopping(Silent):
    """Presses Ctrl-C after so many episodes, and counts what is announced as known."""

    def __init__(self, episodes=10**6):
        self.left, self.off = episodes, 0

    def begin(self, what, known):
        self.off += known

    def episode(self):
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt
