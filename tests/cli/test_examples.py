"""Every command's help has examples, and each of them is one that the command understands."""

import shlex

import pytest

from proxytune.cli.commands import epilog
from proxytune.cli.main import COMMANDS, main, parser


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
