"""A study driven in fleets comes to what it comes to episode by episode, whatever its agents do and however it ends."""

import functools
import json
import os
import signal
import time
from contextlib import redirect_stdout
from io import StringIO

import pytest
from launched import Launched
from partly_dead import ordered_study
from processes import besides_progress, episodes, finished_episodes, trials, wait_for
from searched import searched

from proxytune.cli.main import main
from proxytune.running import Silent
from proxytune.storage import Store
from proxytune.study import open_study, read_study_settings
from proxytune.study.study_run import measure_agents

FAMILY = {"family": '"convoy:convoy"'}
FEW = {"budget": "2", "initial": "2"}
PHASES = {"preflight": "true", "confirm": "1", **FEW}
PER_TRIAL, TRIED = 6 * 3, 6 * 4
"""Episodes of a trial, and those that try the agents."""
HIDES = "does otherwise beside others than by itself, so it is driven alone"


def document(folder, capsys):
    """What `study` prints, as far as it lasts."""
    assert main(["study", str(folder), "--json"]) == 0
    return lasting(capsys.readouterr().out, folder)


def lasting(printed, folder):
    """A document without where the study lies, how long it took, and in how many processes."""
    found = json.loads(printed.replace(str(folder), ""))
    del found["seconds"], found["settings"]["jobs"]
    return found


def driven(journal):
    """The fleets that were driven, each by its agents."""
    return [line.split()[2].split("+") for line in journal.read_text().splitlines()]


@pytest.fixture(scope="module")
def undisturbed(make_studies):
    """The folder and the document of a study that nothing disturbs, by its changes; each is run once."""

    def run(**changes):
        folder = make_studies("_".join(["whole", *changes]), **FAMILY, **changes)
        with redirect_stdout(StringIO()) as printed:
            assert main(["study", str(folder), "--json"]) == 0
        return folder, lasting(printed.getvalue(), folder)

    return functools.cache(run)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("most", "jobs"), [(5, 1), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((1, 2), (48, 3)))]
)
def test_fleets_of_any_size_in_any_jobs_give_the_same_document(
    make_study, undisturbed, capsys, monkeypatch, most, jobs
):
    alone, whole = undisturbed(**PHASES)
    monkeypatch.setattr("proxytune.running.episodes.MOST", most)
    monkeypatch.setattr("proxytune.running.episodes.UNKNOWN", most)
    journal = make_study("other").parent / "journal"
    folder = make_study("other", jobs=str(jobs), domain={"journal": f'"{journal}"'}, **FAMILY, **PHASES)
    assert document(folder, capsys) == whole
    assert episodes(folder) == episodes(alone)
    assert max(map(len, driven(journal))) <= max(2, most)
    assert most == 1 or max(map(len, driven(journal))) > 2


def test_an_agent_that_exits_is_driven_alone_and_told_so(make_study, capsys):
    found = document(make_study(domain={"faults": '["agent2:1:exits"]'}, **FAMILY, **FEW), capsys)
    assert "agent 'agent2' ends what is driven beside it, so it is driven alone" in str(found["cautions"])


@pytest.mark.parametrize("kind", ["hides", pytest.param("draws", marks=pytest.mark.slow)])
def test_an_agent_that_keeps_something_outside_its_memory_is_found_driven_alone_and_named(make_study, capsys, kind):
    journal = make_study().parent / "journal"
    folder = make_study(domain={"faults": f'["agent2:*:{kind}"]', "journal": f'"{journal}"'}, **FAMILY, **FEW)
    assert main(["study", str(folder)]) == 0
    assert f"note: agent 'agent2' {HIDES}" in " ".join(capsys.readouterr().out.split())
    fleets = driven(journal)
    assert [fleet for fleet in fleets if "agent2" in fleet and len(fleet) > 1] == [["agent2", "agent2"]], "tried once"
    assert max(map(len, fleets)) > 4
    assert [HIDES in line and "'agent2'" in line for line in document(folder, capsys)["cautions"]].count(True) == 1


@pytest.mark.slow
def test_what_was_found_of_an_agent_is_known_when_the_study_goes_on(make_study, capsys):
    journal = make_study().parent / "journal"
    first = {**FAMILY, **FEW, "domain": {"faults": '["agent2:*:hides"]', "journal": f'"{journal}"'}}
    document(make_study(**first), capsys)
    journal.unlink()
    found = document(make_study(**{**first, "budget": "3"}), capsys)
    assert {len(fleet) for fleet in driven(journal) if "agent2" in fleet} == {1}
    assert any(HIDES in line for line in found["cautions"])


def test_a_family_that_runs_one_episode_at_a_time_tries_no_agent(finished):
    with Store.read(finished) as store:
        assert "apart" not in store.facts()


def test_measuring_drives_fleets_and_what_hides_something_alone(make_study):
    folder = make_study()
    journal, model = folder.parent / "journal", folder / "model.toml"
    model.write_text("trim = 0.1\n")
    tables = []
    for name, family in (("one", '"wobbly:wobbly"'), ("many", FAMILY["family"])):
        domain = {"journal": f'"{journal}"'}
        tables.append(
            measure_agents(read_study_settings(make_study(name, domain=domain, family=family)), model, 3, Silent())
        )
    assert tables[0].select(["survival_time"]).values.tolist() == tables[1].select(["survival_time"]).values.tolist()
    journal.unlink()
    domain = {"journal": f'"{journal}"', "faults": '["agent2:*:hides"]'}
    measure_agents(read_study_settings(make_study("many", domain=domain, **FAMILY)), model, 3, Silent())
    assert sum("agent2" in fleet and len(fleet) > 1 for fleet in driven(journal)) == 1
    assert max(map(len, driven(journal))) > 4


FAULTS = {
    "raises": "agent 'agent1' raised ValueError at 7 s: no way (deadly.py, line",
    "exits": "the agent or the domain family raised SystemExit: 0 (deadly.py, line",
    "leaves": "it ended its process twice (exit status 9)",
    "hangs": "it took longer than 1 s",
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "jobs"), [("raises", "1"), ("exits", "2"), ("leaves", "1"), ("leaves", "2"), ("hangs", "1")]
)
def test_what_one_agent_does_wrong_is_said_of_it_alone_others_score_as_ever(
    make_study, undisturbed, launcher, fault, jobs
):
    """Of two jobs that hang, joblib's processes are given half a minute more; see tests/running/test_fleets.py."""
    limit = {"episode_timeout_s": "1.0"} if fault == "hangs" else {}
    whole, _ = undisturbed(**FEW)
    folder = make_study(domain={"faults": f'["agent1:1:{fault}"]'}, jobs=jobs, **FAMILY, **limit, **FEW)
    for _ in range(3):
        status, printed = Launched(launcher, folder, ["study", str(folder), "--json"]).end()
        if fault != "leaves" or status != 9:
            break
    assert status == 0, printed
    assert json.loads(besides_progress(printed))["episodes"]["failed"] == 2
    scored, expected = episodes(folder), episodes(whole)
    assert [one for one in scored if one[4]] == [one for one in expected if one[1:3] != ("agent1", 1)]
    with Store.read(folder) as store:
        known = [one for trial in store.trials() for one in store.outcomes("wobbly 1 ()", trial.theta).values()]
    assert {one.failure[: len(FAULTS[fault])] for one in known if one.failure} == {FAULTS[fault]}


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_killed_in_the_middle_of_a_fleet_nothing_finished_is_driven_again_and_the_result_is_the_same(
    make_study, undisturbed, launcher, tmp_path, jobs
):
    (whole, _), journal = undisturbed(), tmp_path / "journal"
    folder = make_study("stopped", domain={"sleep": "0.3", "journal": f'"{journal}"'}, jobs=jobs, **FAMILY)
    lost = 0
    for moment in (15, 60):
        process = Launched(launcher, folder)
        wait_for(folder, process, moment)
        os.kill(process.pid, signal.SIGSTOP)  # so that no fleet ends between the look and the kill
        while sum(map(len, driven(journal))) - TRIED - lost <= finished_episodes(folder):
            os.kill(process.pid, signal.SIGCONT)
            time.sleep(0.01)
            os.kill(process.pid, signal.SIGSTOP)
        os.kill(process.pid, signal.SIGKILL)
        assert process.end()[0] == -signal.SIGKILL
        assert process.leaves_nothing()
        before, lost = lost, sum(map(len, driven(journal))) - TRIED - finished_episodes(folder)
        assert 0 < lost - before <= PER_TRIAL
    status, printed = Launched(launcher, folder).end()
    assert status == 0, printed
    assert (trials(folder), episodes(folder)) == (trials(whole), episodes(whole))
    assert sum(map(len, driven(journal))) - TRIED - finished_episodes(folder) == lost


@pytest.fixture(scope="module")
def one_by_one(make_studies):
    """What a study with pruning cost, agent by agent, and its trials, by its changes; run once for each."""
    return functools.cache(
        lambda **keys: searched(open_study(ordered_study(make_studies, f"alone{len(keys)}", **keys)))
    )


@pytest.mark.slow
@pytest.mark.parametrize(("keys", "wave"), [({}, 1), ({}, 16), ({}, 1000), ({"batch": "3"}, 16), ({"jobs": "2"}, 16)])
def test_waves_of_any_size_prune_the_trials_that_agent_by_agent_are_pruned(
    make_study, one_by_one, monkeypatch, wave, keys
):
    """Those beside the last agent that was needed are driven in vain, and no trial stands on them."""
    least, expected = one_by_one(**{key: value for key, value in keys.items() if key != "jobs"})
    monkeypatch.setattr("proxytune.study.study_run.WAVE", wave)
    spent, found = searched(open_study(ordered_study(make_study, family='"partly_dead:ordered_fleet"', **keys)))
    assert found == expected
    assert any(trial.state == "cut" for trial in found)
    assert spent.episodes - spent.unused == least.episodes - least.unused
    assert least.unused == 0
    if not keys:
        assert (spent.unused > 0) == (wave > 1)
        assert (spent.episodes < 14 * 8 * 3) == (wave < 1000)
