"""A disk that fails at a chosen write: every change of a file is counted, Python's own and SQLite's.

Run as a script it is the command line: it loads proxytune once and forks for each command, so that a test can afford a
process for every write. It runs the command of its own words; then it reads one JSON list per line: which change is the
last, how it fails, the file for what is printed, and a command's words; it writes the status with which that ended, and
how many changes it made.
"""

import _sqlite3
import builtins
import ctypes
import errno
import gc
import io
import json
import mmap
import os
import signal
import subprocess
import sys
from contextlib import contextmanager, redirect_stdout

from processes import ENVIRONMENT

SQLITE = ctypes.CDLL(_sqlite3.__file__)
HOOKED = hasattr(SQLITE, "sqlite3_vfs_find")
"""Whether SQLite's calls of the system can be counted here: not where its library hides its names."""
POINTER, SIZE = ctypes.c_void_p, ctypes.c_size_t
WRITE = ctypes.CFUNCTYPE(ctypes.c_ssize_t, ctypes.c_int, POINTER, SIZE, ctypes.c_int64, use_errno=True)
UNLINK = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_char_p, use_errno=True)
TRUNCATE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, ctypes.c_int64, use_errno=True)
SET_CALL = ctypes.CFUNCTYPE(ctypes.c_int, POINTER, ctypes.c_char_p, POINTER)


class FileSystem(ctypes.Structure):
    """SQLite's sqlite3_vfs, as far as it is needed: the calls of the system that it makes can be replaced."""

    _fields_ = (("numbers", ctypes.c_int * 3), ("others", POINTER * 16), ("set_system_call", SET_CALL))


class Disk:
    """Counts changes of files; at the last one it fails.

    Attributes:
        last: Which one that is, from 1.
        how: "before" to kill the process before it, "within" when half of it is written; "full" to have room for half
            of it, and for nothing more.
    """

    def __init__(self, last, how):
        self.last, self.how = last, how
        # In memory that a killed process leaves to the one that started it.
        self.shared = mmap.mmap(-1, 8)

    @property
    def changes(self):
        return int.from_bytes(self.shared[:8], "little")

    def write(self, content, write):
        """Write as much as there is room for; how much that was."""
        self._count()
        if self.changes < self.last:
            return write(content)
        half = content[: len(content) // 2]
        if self.how == "full":
            if self.changes == self.last and half:
                return write(half)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        if self.how == "within":
            write(half)
        return os.kill(os.getpid(), signal.SIGKILL)

    def change(self, do):
        """Rename, remove or shorten a file, for which a full disk has room."""
        self._count()
        if self.changes == self.last and self.how != "full":
            os.kill(os.getpid(), signal.SIGKILL)
        return do()

    def _count(self):
        self.shared[:8] = (self.changes + 1).to_bytes(8, "little")


def take_python(disk):
    """Let all that Python writes and moves go to this disk."""
    real_open, pwrite = io.open, os.pwrite

    class Raw(io.FileIO):
        def write(self, content):
            return disk.write(bytes(content), super().write)

    def opened(file, mode="r", buffering=-1, encoding=None, errors=None, newline=None, **more):
        if not set(mode) & set("wax+"):
            return real_open(file, mode, buffering, encoding, errors, newline, **more)
        raw = Raw(file, mode.replace("b", "").replace("t", ""), **more)
        buffered = io.BufferedRandom(raw) if "+" in mode else io.BufferedWriter(raw)
        return buffered if "b" in mode else io.TextIOWrapper(buffered, encoding, errors, newline)

    io.open = builtins.open = opened
    os.pwrite = lambda file, content, place: disk.write(content, lambda part: pwrite(file, part, place))
    for name in ("replace", "rename", "unlink"):
        setattr(os, name, changing(disk, getattr(os, name)))


def changing(disk, do):
    """A function that changes a file, on this disk."""
    return lambda *words, **how: disk.change(lambda: do(*words, **how))


def take_sqlite(disk):
    """Let all that SQLite writes, removes and shortens go to this disk."""
    pwrite, unlink, truncate = os.pwrite, os.unlink, os.ftruncate

    def write(file, content, size, place):
        return disk.write(ctypes.string_at(content, size), lambda part: pwrite(file, part, place))

    calls = {
        b"pwrite": WRITE(answering(write)),
        b"pwrite64": WRITE(answering(write)),
        b"unlink": UNLINK(answering(changing(disk, unlink))),
        b"ftruncate": TRUNCATE(answering(changing(disk, truncate))),
    }
    SQLITE.sqlite3_vfs_find.restype = ctypes.POINTER(FileSystem)
    system = SQLITE.sqlite3_vfs_find(None)
    for name, call in calls.items():
        system.contents.set_system_call(ctypes.cast(system, POINTER), name, ctypes.cast(call, POINTER))
    return calls


def answering(do):
    """A function of Python as one of C: -1 and errno in place of an OSError."""

    def call(*words):
        try:
            return do(*words) or 0
        except OSError as problem:
            ctypes.set_errno(problem.errno)
            return -1

    return call


def run_child(disk, output, words):
    """In the forked process: run the command on this disk."""
    os.setsid()
    descriptor = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for stream in (1, 2):
        os.dup2(descriptor, stream)
    calls = take_sqlite(disk)
    take_python(disk)
    status = main(words)
    sys.stdout.flush()
    sys.stderr.flush()
    assert calls
    os._exit(status)


class Forker:
    """Runs commands in forks of one process that has loaded proxytune."""

    def __init__(self, process, output):
        self._process, self.output = process, output

    def run(self, *words, last=10**9, how="full"):
        """A command on a disk of which this change is the last: its status, and how many it made."""
        self._process.stdin.write(json.dumps([last, how, str(self.output), *map(str, words)]) + "\n")
        self._process.stdin.flush()
        return tuple(json.loads(self._process.stdout.readline()))

    @property
    def printed(self):
        """What the last command printed, on both streams."""
        return self.output.read_text()


@contextmanager
def forking(output, *words):
    """A forker that has run one command itself, and so has loaded all it takes; the others print into this file."""
    command = [sys.executable, __file__, *map(str, words)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, env=ENVIRONMENT, **pipes) as process:
        yield Forker(process, output)
        process.stdin.close()


class Here:
    """In place of an isolated worker, which takes a second to start: an episode that a kill broke off is run here."""

    def __init__(self, work, timeout_s=None):
        self._work = work

    def __enter__(self):
        return self

    def __exit__(self, *problem):
        pass

    def do(self, piece, lost):
        return self._work(piece)


def only_search(arguments):
    """`study` without the answer and the figures, which write no database and take nine tenths of the time."""
    studies.result_of = lambda run: None
    study = open_study(arguments.path)
    command.run_opened(study, command._bars(study), command._say, False)
    return Answer({}, "")


if __name__ == "__main__":
    from proxytune.api import study as studies
    from proxytune.cli import study as command
    from proxytune.cli.main import main
    from proxytune.cli.terminal import Answer
    from proxytune.running import workers
    from proxytune.study import open_study

    workers.IsolatedWorker, command.run = Here, only_search
    with redirect_stdout(io.StringIO()):
        main(sys.argv[1:])
    gc.freeze()
    for line in iter(sys.stdin.readline, ""):
        last, how, output, *words = json.loads(line)
        disk = Disk(last, how)
        child = os.fork()
        if child == 0:
            run_child(disk, output, words)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        print(json.dumps([status, disk.changes]), flush=True)
