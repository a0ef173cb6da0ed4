"""The commands of docs/how-to/cluster.md work as they stand, on a study that takes seconds."""

import os
import re
import shlex
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from processes import ENVIRONMENT

PAGE = (Path(__file__).resolve().parent.parent / "docs" / "how-to" / "cluster.md").read_text(encoding="utf-8")
LINES = [line for block in re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL) for line in block.splitlines()]


def free_port():
    with socket.socket() as some:
        some.bind(("127.0.0.1", 0))
        return str(some.getsockname()[1])


@pytest.mark.slow
def test_a_scheduler_two_workers_and_a_study(make_study, tmp_path):
    pytest.importorskip("distributed")
    folder, port = make_study(domain={"sleep": "0.01"}), free_port()
    install, *commands = [line.replace("8786", port).replace("studies/quickstart", str(folder)) for line in LINES]
    assert install == 'pip install "proxytune[dask]"'
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    started = []
    try:
        for line in commands[:-1]:
            words = shlex.split(line.removesuffix(" &")) + (["--no-dashboard"] if "worker" in line else [])
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            started.append(subprocess.Popen(words, env={**ENVIRONMENT, "PATH": path}, cwd=tmp_path, **quiet))
        words = [sys.executable, *shlex.split(commands[-1])[1:]]
        done = subprocess.run(words, env=ENVIRONMENT, cwd=tmp_path, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        assert "PRPV" in done.stdout
    finally:
        for process in started:
            process.terminate()
        for process in started:
            process.wait(30)
