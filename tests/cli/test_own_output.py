"""Standard output is the answer alone, in whatever letters it can hold."""

import json
import os
import subprocess
import sys

import pytest

from proxytune.cli import listing
from proxytune.cli.main import main
from proxytune.cli.terminal import Answer, prints_to_stderr

CHATTER = """
import os, subprocess, sys
from proxytune.cli import listing
from proxytune.cli.main import main
answer = listing.run
def chatty(arguments):
    print("an agent")
    os.write(1, b"its library\\n")
    subprocess.run(["echo", "its process"], check=True)
    return answer(arguments)
listing.run = chatty
sys.exit(main(["list", "maps", "--json"]))
"""


def run(code, **environment):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, env={**os.environ, **environment})


def test_what_an_agent_its_libraries_and_its_processes_print_goes_to_standard_error():
    done = run(CHATTER)
    assert json.loads(done.stdout)["maps"]
    assert set(done.stderr.decode().splitlines()) == {"an agent", "its library", "its process"}


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252"])
def test_a_standard_output_of_few_letters_gets_the_answer_with_the_others_escaped(encoding):
    shown = "main(['list', 'effects']); print('cut', flush=True); main(['list', 'effects', '--json'])"
    done = run(f"from proxytune.cli.main import main; {shown}", PYTHONIOENCODING=encoding)
    assert (done.returncode, done.stderr) == (0, b"")
    table, document = done.stdout.decode(encoding).split("\ncut\n")
    assert "dead_band" in table
    assert json.loads(document)["effects"]


def test_a_path_that_is_no_utf_8_is_json_all_the_same(monkeypatch, capsys):
    monkeypatch.setattr(listing, "run", lambda arguments: Answer({"path": "caf\udce9"}, ""))
    assert main(["list", "maps", "--json"]) == 0
    assert json.loads(capsys.readouterr().out.encode("utf-8")) == {"path": "caf\udce9"}


def test_standard_output_is_the_answer_alone_also_closed_or_after_an_error(capfd):
    code = "import os; os.close(1); from proxytune.cli.terminal import prints_to_stderr as p\nwith p(): pass"
    assert run(code).returncode == 0
    with pytest.raises(ValueError, match="x"), prints_to_stderr():
        raise ValueError("x")
    os.write(1, b"here")
    assert capfd.readouterr().out == "here"
