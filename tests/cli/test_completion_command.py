"""`completion` prints a script that the shell reads and that completes commands, options and files."""

import shutil
import subprocess
import sys

import pytest

from proxytune.cli.commands import OPTIONS
from proxytune.cli.main import COMMANDS, main


@pytest.mark.parametrize("shell", OPTIONS["completion"]["shell"]["choices"])
def test_every_command_is_in_the_script_of_every_shell(shell, capsys, answered):
    pytest.importorskip("shtab")
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert all(command in script for command in COMMANDS)
    assert "python -m" not in script, "it is for the program's own name"
    assert answered("completion", shell) == {"shell": shell, "script": script.removesuffix("\n")}


def test_bash_completes_a_command_an_option_and_a_file(tmp_path, capsys):
    pytest.importorskip("shtab")
    if not shutil.which("bash"):
        pytest.skip("this system has no bash")
    assert main(["completion", "bash"]) == 0
    (tmp_path / "proxytune.sh").write_text(capsys.readouterr().out)
    (tmp_path / "twin.toml").write_text("")
    asked = {"dia": 1, "study --bud": 2, "measure x --model twi": 4, "completion z": 2}
    lines = [
        f"COMP_WORDS=(proxytune {words}); COMP_CWORD={place}; COMPREPLY=(); _shtab_proxytune; echo ${{COMPREPLY[@]}}"
        for words, place in asked.items()
    ]
    script = "\n".join(["source ./proxytune.sh", *lines])
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.stdout.splitlines() == ["diagnose", "--budget", "twin.toml", "zsh"], done.stderr


def test_without_shtab_there_is_one_line_on_what_to_install(monkeypatch, refused):
    monkeypatch.setitem(sys.modules, "shtab", None)
    told = refused("completion", "bash")
    assert told.endswith('which is not installed; pip install ".[completion]" in the checkout of proxytune\n')
