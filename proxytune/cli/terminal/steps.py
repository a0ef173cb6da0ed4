"""Progress of a command in several steps: a bar with the time left on a terminal, elsewhere a line per step."""

from collections.abc import Mapping

from proxytune.running import Lines, progress_bar


class Steps:
    """Shows each step as it begins; use as a context."""

    def __init__(self, shares: Mapping[str, float]) -> None:
        """Begin with nothing done.

        Args:
            shares: By how a step's line begins, the share of the whole time that has usually passed by then.
        """
        self._shares, self._lines = shares, Lines()
        self._bar = progress_bar(self._lines.console, speed_estimate_period=3600.0)
        self._task = self._bar.add_task("", total=1.0)

    def __enter__(self) -> "Steps":
        self._bar.start()
        return self

    def __exit__(self, *problem: object) -> None:
        self._bar.stop()

    def __call__(self, step: str) -> None:
        """Show that a step begins; the bar never goes back."""
        self._lines.say(step)
        share = max((over for begin, over in self._shares.items() if step.startswith(begin)), default=0.0)
        self._bar.update(self._task, description=step, completed=max(share, self._bar.tasks[0].completed))
