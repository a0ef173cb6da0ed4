"""Studies as real processes that a test can afford: forked from one that has loaded proxytune, watched, and killed."""

import fcntl
import json
import os
import subprocess
import sys
import time
from contextlib import contextmanager, suppress

from processes import ENVIRONMENT, FAKES, episodes, trials
from searched import searched

from proxytune.study import open_study


class Launched:
    """A study, or a command, run by a fork of a process that has loaded proxytune; one at a time.

    A module of fakes may `change` something in it first.
    """

    def __init__(self, launcher, folder, words=None, changed=None):
        # What is left of a killed process, joblib's clean-up, may still print: into a file of its own.
        self.launcher, self.output = launcher, folder.with_name(f"{folder.name}_{time.monotonic_ns()}.txt")
        self.output.touch()  # one that is killed at once makes none
        launcher.stdin.write(
            json.dumps([changed, *(words or ["study", str(folder)]), "--json", str(self.output)]) + "\n"
        )
        launcher.stdin.flush()
        self.pid = int(launcher.stdout.readline())

    def poll(self):
        """Something once it has ended."""
        try:
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return True

    def end(self):
        """Wait for its end: exit status, and what it printed."""
        return int(self.launcher.stdout.readline()), self.output.read_text()

    def leaves_nothing(self):
        """Whether its processes end too: as long as one of them could still print, the file is locked."""
        with self.output.open() as file:
            for _ in range(600):
                with suppress(BlockingIOError):
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    return True
                time.sleep(0.05)
        return False


@contextmanager
def launching(script="launcher.py", **environment):
    """The process that forks the others, of a script among the fakes, with more in its environment."""
    command = [sys.executable, str(FAKES / script)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, env=ENVIRONMENT | environment, start_new_session=True, **pipes) as process:
        yield process
        process.stdin.close()


def never_stopped(make_study, **changes):
    """The study run in this process, in one go: its trials and episodes."""
    folder = make_study("whole", **changes)
    searched(open_study(folder))
    return trials(folder), episodes(folder)
