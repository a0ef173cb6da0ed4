"""Loads proxytune once and forks for each command, so that a test can afford many real processes.

Reads one JSON list per line: a module that changes something first, or null; the words of a command; the file for what
it prints. Writes its process id when it begins and its wait status when it has ended. Every module of proxytune is
loaded beforehand, and what that needs, and figures are blank: a command's time is that of its work. joblib's processes
import this file, and nothing by it.
"""

import fcntl
import json
import os
import signal
import sys
from importlib import import_module

if __name__ == "__main__":
    import loaded

    from proxytune.cli.main import main

    assert loaded
    for line in iter(sys.stdin.readline, ""):
        changed, *words, output = json.loads(line)
        child = os.fork()
        if child == 0:
            os.setsid()
            signal.signal(signal.SIGINT, signal.default_int_handler)
            descriptor = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            fcntl.flock(descriptor, fcntl.LOCK_SH)
            for stream in (1, 2):
                os.dup2(descriptor, stream)
            if changed:
                import_module(changed).change()
            raise SystemExit(main(words))
        print(child, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
