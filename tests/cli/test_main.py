"""Each command: one document or one line of complaint, examples in its help, completion; stdout is the answer alone."""

import errno
import json
import os
import re
import shlex
import shutil
import subprocess
import sys

import pytest

import proxytune as proxytune_package
from proxytune.api import TRIALS
from proxytune.cli import listing, plot
from proxytune.cli.commands import OPTIONS, epilog
from proxytune.cli.diagnose import limits_of
from proxytune.cli.main import BAD_INPUT, COMMANDS, DONE, FAILED, formats, main, parse, parser
from proxytune.cli.terminal import Answer, print_answer, prints_to_stderr
from proxytune.diagnosis import LIMITS
from proxytune.errors import EpisodeError, ScoresError, SettingsError, StoreError
from proxytune.extensions import Interrupted
from proxytune.logs import COMMANDS as KINDS
from proxytune.report import FILTER, FORMATS
from proxytune.report.text import file_texts, group_texts
from proxytune.seeds import TARGET_OFFSET
from proxytune.starting import STOPPING


@pytest.fixture
def failing(monkeypatch):
    """Make `list` raise."""

    def make(problem):
        def run(arguments):
            raise problem

        monkeypatch.setattr(listing, "run", run)

    return make


def test_a_library_that_stumbles_over_too_few_descriptors_is_one_line(failing, capsys):
    problem = UnboundLocalError("child_r")
    problem.__context__ = OSError(errno.EMFILE, "Too many open files")
    failing(problem)
    assert main(["list", "robots"]) == FAILED
    assert re.fullmatch(
        r"proxytune list: the system refused something \(.*Too many open files\); allow more open files .*\n",
        capsys.readouterr().err,
    )
    problem.__context__ = OSError(errno.ENOENT, "a file that somebody looked for")
    with pytest.raises(UnboundLocalError):
        main(["list", "robots"])


@pytest.mark.parametrize("kind", listing._KINDS)
def test_json_is_one_document_and_nothing_else(kind, capsys):
    assert main(["list", kind, "--json"]) == 0
    out = capsys.readouterr()
    assert json.loads(out.out)[kind]
    assert out.err == ""


def test_every_table_of_options_is_a_command_s_and_says_of_the_code_what_is_so():
    assert OPTIONS["list"]["kind"]["choices"] == list(listing._KINDS)
    assert OPTIONS["export"]["--to"]["choices"] == [*FORMATS, FILTER, *TRIALS]
    assert OPTIONS["source"]["a bag, table or trajectory as LOG"]["--kind"]["choices"] == list(KINDS)
    assert f"plus {TARGET_OFFSET}]" in OPTIONS["measure"]["--seed"]["help"]
    assert f"PATH/{plot.RESCORED}/METRICS" in OPTIONS["plot"]["--metric"]["help"]
    assert limits_of(parse(["diagnose", "log"])) == LIMITS
    assert set(OPTIONS) == {*COMMANDS, *(name for one in COMMANDS.values() for name in one.shares)}


def test_without_a_command_there_is_help_the_version_is_the_package_s_and_an_unknown_format_wrong(capsys):
    assert main([]) == DONE
    assert "diagnose" in capsys.readouterr().out
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0
    assert capsys.readouterr().out == f"proxytune {proxytune_package.__version__}\n"
    with pytest.raises(SystemExit) as caught:
        main(["plot", "study", "--format", "svg,gif"])
    assert caught.value.code == 2
    assert "'gif' is none of png, svg, pdf" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["studdy"], "argument COMMAND: unknown 'studdy'; did you mean 'study'?"),
        (["study", "--budgett", "3", "q"], "unknown option '--budgett'; did you mean '--budget'?"),
        (["study", "--budgett=3", "q"], "unknown option '--budgett'; did you mean '--budget'?"),
        (["list", "efects"], "unknown 'efects'; did you mean 'effects'?"),
        (["plot", "one", "two", "three"], "unrecognized arguments: two three"),
        (["study"], "the following arguments are required: PATH"),
        (["score", "--resamples", "many"], "argument --resamples: invalid int value: 'many'"),
    ],
)
def test_a_mistyped_word_is_answered_in_one_line_with_the_one_that_was_probably_meant(capsys, words, problem):
    with pytest.raises(SystemExit) as end:
        main(words)
    assert end.value.code == BAD_INPUT == 2
    told = capsys.readouterr().err
    assert re.fullmatch(rf"(python -m proxytune[ a-z]*): .*{re.escape(problem)} \(see \1 --help\)\n", told)


FOREIGN = "code that is not proxytune's ended the command"


@pytest.mark.parametrize(
    ("problem", "status", "told"),
    [
        (SettingsError("a: b"), BAD_INPUT, "a: b\n"),
        (ScoresError("a: b"), BAD_INPUT, "a: b\n"),
        (StoreError("a: b"), FAILED, "a: b\n"),
        (EpisodeError("a: b"), FAILED, "a: b\n"),
        (SystemExit(0), FAILED, f"{FOREIGN} (SystemExit: 0)"),
        (KeyboardInterrupt("mine"), FAILED, f"{FOREIGN} (KeyboardInterrupt: mine)"),
        (MemoryError("7.28 TiB"), FAILED, "memory ran out (MemoryError: 7.28 TiB); ask for less"),
        (OSError(36, "File name too long", "a\nb"), FAILED, "the system refused something (OSError: "),
    ],
)
def test_a_mistake_and_a_trouble_that_nobody_named_are_one_line(failing, refused, problem, status, told):
    failing(problem)
    assert refused("list", "robots", "--json", status=status).startswith(f"proxytune list: {told}")


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({}, "nothing was written; run the same command to start again"),
        ({"resumes": True}, "everything finished is kept; run the same command to continue"),
        ({"kept": "half of it is there"}, "half of it is there; run the same command to start again"),
    ],
)
def test_an_interruption_says_whether_the_same_command_goes_on(failing, refused, monkeypatch, changes, told):
    failing(Interrupted())
    monkeypatch.setitem(COMMANDS, "list", COMMANDS["list"]._replace(**changes))
    assert told in refused("list", "robots", status=130)


def test_an_interruption_that_a_library_made_another_error_of_is_told_as_one(failing, refused):
    """As Python 3.11 does of what comes while a class is made."""
    problem = RuntimeError("Error calling __set_name__")
    problem.__cause__ = Interrupted()
    failing(problem)
    assert refused("list", "robots", status=130).startswith("proxytune list: interrupted; ")


def test_what_is_not_json_is_a_defect_and_not_printed_but_a_path_that_is_no_utf_8_is(monkeypatch, capsys):
    monkeypatch.setattr(listing, "run", lambda arguments: Answer({"value": float("nan")}, ""))
    with pytest.raises(ValueError, match="JSON"):
        main(["list", "robots", "--json"])
    monkeypatch.setattr(listing, "run", lambda arguments: Answer({"path": "caf\udce9"}, ""))
    assert main(["list", "maps", "--json"]) == 0
    assert json.loads(capsys.readouterr().out.encode("utf-8")) == {"path": "caf\udce9"}


def test_a_path_with_blanks_that_is_piped_stands_in_one_line_and_on_a_terminal_it_is_broken(monkeypatch, capsys):
    path = "/home/me/the measurements of spring/" + "a long name " * 6 + ".png"
    monkeypatch.setenv("COLUMNS", "80")
    print_answer(Answer({}, group_texts(*file_texts({"figure": path}))), as_json=False)
    assert capsys.readouterr().out == f"figure: {path}\n"
    monkeypatch.setenv("FORCE_COLOR", "1")
    print_answer(Answer({}, group_texts(*file_texts({"figure": path}))), as_json=False)
    assert len(capsys.readouterr().out.splitlines()) == 2


@pytest.mark.parametrize(
    ("started", "name"),
    [
        ("/usr/local/bin/proxytune", "proxytune"),
        ("/lib/proxytune/__main__.py", "python -m proxytune"),
        ("/bin/pytest", "python -m proxytune"),
    ],
)
def test_the_program_says_the_name_it_was_started_by(started, name, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [started])
    with pytest.raises(SystemExit):
        main(["study", "--help"])
    told = capsys.readouterr().out
    assert told.startswith(f"usage: {name} study ")
    assert f"\n  {name} study quickstart\n" in told


@pytest.mark.parametrize("status", [DONE, FAILED, BAD_INPUT, *(128 + number for number in STOPPING)])
def test_help_says_every_exit_status(status, capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    assert re.search(rf"\b{status}\b", capsys.readouterr().out.partition("exit status:")[2])


@pytest.mark.slow
def test_no_color_leaves_tables_without_colours():
    """On a terminal of many colours; bold is no colour."""
    import pty

    for more, coloured in (({}, True), ({"NO_COLOR": "1"}, False)):
        leader, follower = pty.openpty()
        environment = {name: value for name, value in os.environ.items() if name != "NO_COLOR"} | more
        code = "import rich; rich.print('[red]x'); from proxytune.cli.main import main"
        words = [sys.executable, "-c", f"{code}; main(['list', 'robots']); main(['study', 'gone'])"]
        with subprocess.Popen(
            words, stdout=follower, stderr=follower, env=environment | {"TERM": "xterm-256color"}
        ) as process:
            process.wait(timeout=60)
        shown = os.read(leader, 1 << 16).decode()
        os.close(leader), os.close(follower)
        assert "duckiebot" in shown
        assert "no such folder" in shown
        assert ("\x1b[3" in shown) == coloured


@pytest.mark.parametrize(("text", "also"), [("svg,pdf", ("svg", "pdf")), ("png", ()), (" pdf , png,pdf", ("pdf",))])
def test_formats_are_those_beside_png(text, also):
    assert formats(text) == also


@pytest.mark.slow
def test_a_closed_pipe_is_no_error(tmp_path):
    line = f"{sys.executable} -m proxytune list effects --json | head -c 1"
    path = os.pathsep.join(filter(None, (os.getcwd(), os.environ.get("PYTHONPATH"))))
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", line], capture_output=True, text=True, cwd=tmp_path, check=False,
        env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_bullet_starts_without_a_word(tmp_path):
    """PyBullet's own announcement of its build time would stand where people look for what went wrong."""
    code = "import proxytune.driving.family"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")


def test_every_command_has_two_or_three_examples_and_no_other_has():
    assert {2, 3} >= {len(command.examples) for command in COMMANDS.values()}


@pytest.mark.parametrize("line", [line for command in COMMANDS.values() for line in command.examples])
def test_every_example_is_understood(line):
    words = shlex.split(line.partition(" > ")[0])
    assert parser(words).parse_args(words).command == words[0]


@pytest.mark.parametrize("command", COMMANDS)
def test_help_shows_the_examples_as_they_are_typed(command, capsys):
    with pytest.raises(SystemExit) as end:
        main([command, "--help"])
    told = capsys.readouterr().out
    assert end.value.code == 0
    assert "--json" in told
    assert epilog(command, "python -m proxytune") in told


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


def test_standard_output_is_the_answer_alone_also_closed_or_after_an_error(capfd):
    code = "import os; os.close(1); from proxytune.cli.terminal import prints_to_stderr as p\nwith p(): pass"
    assert run(code).returncode == 0
    with pytest.raises(ValueError, match="x"), prints_to_stderr():
        raise ValueError("x")
    os.write(1, b"here")
    assert capfd.readouterr().out == "here"
