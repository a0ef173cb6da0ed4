"""Studies whose agents end their process or never end: the real command, run again as a user would."""

import re

import pytest
from processes import besides_progress, start

from proxytune.cli.main import main
from proxytune.running import episodes
from proxytune.storage import Store

FAMILY = {"family": '"deadly:deadly"', "budget": "2", "initial": "2"}


def failures(folder):
    with Store.read(folder) as store:
        thetas = [trial.theta for trial in store.trials()]
        known = [one for theta in thetas for one in store.outcomes("wobbly 1 ()", theta).values()]
    return {(one.episode.agent, one.episode.start): one.failure for one in known if one.failure}


def domain(fault):
    return {"faults": f'["agent1:1:{fault}"]'}


@pytest.mark.slow
def test_an_agent_that_ends_the_study_s_own_process_is_named_by_the_next_run_which_goes_on(make_study):
    folder = make_study(domain=domain("dies"), **FAMILY)
    process = start("study", folder)
    out, told = process.communicate(timeout=300)
    assert (process.returncode, out) == (9, "")
    ended = r"proxytune study: code that is not proxytune's ended the process with status 9 \(wobbly\.py, line .*; .*\n"
    assert re.fullmatch(ended, besides_progress(told))
    assert not failures(folder)
    assert main(["study", str(folder)]) == 0
    assert failures(folder) == {("agent1", 1): "it ended its process twice (exit status 9)"}


@pytest.mark.parametrize(
    ("fault", "jobs"), [("exits", "1"), *(pytest.param("interrupts", jobs, marks=pytest.mark.slow) for jobs in "12")]
)
def test_an_agent_that_exits_or_interrupts_fails_and_the_study_goes_on(make_study, answered, fault, jobs):
    assert answered("study", make_study(domain=domain(fault), jobs=jobs, **FAMILY))["episodes"]["failed"] == 2


@pytest.mark.parametrize("jobs", ["1", pytest.param("2", marks=pytest.mark.slow)])
def test_what_the_machine_lacks_stops_the_study_and_is_not_kept(make_study, capsys, jobs):
    folder = make_study(domain=domain("memory"), jobs=jobs, **FAMILY)
    assert main(["study", str(folder)]) == 1
    told = besides_progress(capsys.readouterr().err)
    assert re.fullmatch(r"proxytune study: agent 'agent1' from start 1: the machine failed \(MemoryError.*\n", told)
    assert not failures(folder)


@pytest.mark.slow
@pytest.mark.parametrize("command", [["study"], ["sweep", "--parameter", "trim", "--points", "2"]])
def test_an_agent_that_takes_long_is_told_of_where_nothing_limits_its_time(make_study, capsys, monkeypatch, command):
    monkeypatch.setattr(episodes, "LONG_S", 0.2)
    name, *more = command
    assert main([name, str(make_study(domain=domain("lingers"), **FAMILY)), *more]) == 0
    said = capsys.readouterr().err
    assert "s: agent 'agent1' from start 1 has been under way for 0 min; episode_timeout_s in study.toml would" in said
