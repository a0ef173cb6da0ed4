"""Teaching killed by kill -9 within lessons, trainings, examinations and the rule: the same document to the bit."""

import json
import re
import shutil
import signal

import pytest
from launched import Launched, launching
from processes import but_for, finished_episodes, trials
from several import make_several
from taught import TEACHING, make_taught

pytestmark = pytest.mark.slow
SMALL = {"agents": '["agent0", "agent1"]', "metrics": '["distance:max"]', "starts": "2"}
ROOM = {"family": '"mortal:mortal_schoolroom"', "grid": [0, 20, 40, 80, 160, 320]}
ROPE = {"family": '"mortal:mortal_tightrope"', "grid": [0, 20, 40, 80, 160]}


class Commands:
    """Runs commands in forks of one process that has loaded proxytune; each can be killed at a moment of its own."""

    def __init__(self, process, fate):
        self._process, self._fate, self.printed = process, fate, ""

    def run(self, *words, fate=None):
        """A command killed at a moment, or never: its status."""
        self._fate.unlink(missing_ok=True)
        if fate:
            self._fate.write_text(fate)
        self._fate.with_name("moments").write_text("")
        status, self.printed = Launched(self._process, self._fate, map(str, words)).end()
        return status

    @property
    def document(self):
        """What the last command printed on standard output, as it stands there."""
        return re.search(r"^\{.*\}$", self.printed, re.DOTALL | re.MULTILINE)[0]


@pytest.fixture(scope="module")
def commands(tmp_path_factory):
    fate = tmp_path_factory.mktemp("mortal") / "fate"
    with launching("mortal.py", FATE=str(fate)) as process:
        yield Commands(process, fate)


def make_mortal(make_study, **changes):
    folder = make_taught(make_study, **{**SMALL, **changes})
    path = folder / "study.toml"
    learner = "MortalCells" if changes["family"] == ROPE["family"] else "MortalMatrix"
    path.write_text(path.read_text().replace("schoolroom:Matrix", f"mortal:{learner}"))
    return folder


def kill_at(commands, words, moments, whom, told=lambda: None):
    """Run a command that is killed at each moment in turn, and then to its end; what is told after each kill."""
    known = []
    for moment in moments:
        assert commands.run(*words, fate=f"{moment} {whom}") == -signal.SIGKILL, (moment, commands.printed)
        known.append(told())
    assert commands.run(*words) == 0, commands.printed
    return known


ON_POLICY = 'target_lessons = "learner"\nproxy_lessons = "learner"\nrehearsal = 0.5'
TAUGHT = {
    "every count": (ROOM, ("lesson 9", "training 2", "exam 60", "episode 5")),
    "chosen": ({**ROOM, "more": "examinations = 17"}, ("lesson 9", "training 2", "exam 3", "rule 3")),
    "learner drives": (
        {**ROPE, "more": f"examinations = 17\n{ON_POLICY}"},
        ("guided 9", "training 5", "exam 9", "rule 3"),
    ),
}
"""Studies, and at what a run is killed, again and again, on its way."""


@pytest.fixture(scope="module")
def taught(make_studies, commands):
    """Makes a study of TAUGHT, always in the same folder, and gives what a run prints that was never killed."""
    printed = {}

    def make(name, jobs):
        folder = make_mortal(make_studies, **TAUGHT[name][0], jobs=jobs)
        if name not in printed:
            assert commands.run("teach", folder) == 0, commands.printed
            printed[name] = commands.document.replace(f'"jobs": {jobs}', '"jobs": N')
        for kept in ("teaching", "figures"):
            shutil.rmtree(folder / kept, ignore_errors=True)
        (folder / "study.db").unlink(missing_ok=True)
        return folder, printed[name].replace('"jobs": N', f'"jobs": {jobs}')

    return make


@pytest.mark.parametrize(
    ("name", "jobs", "whom"), [("every count", "1", "all"), ("chosen", "2", "command"), ("learner drives", "1", "all")]
)
def test_teaching_killed_again_and_again_prints_the_same_document_to_the_byte(taught, commands, name, jobs, whom):
    folder, whole = taught(name, jobs)
    kill_at(commands, ("teach", folder), TAUGHT[name][1], whom)
    assert commands.document == whole


@pytest.mark.parametrize("moment", ["lesson 9", "exam 9"])
def test_a_process_of_its_own_that_is_killed_costs_teaching_nothing(taught, commands, moment):
    folder, whole = taught("chosen", "2")
    assert commands.run("teach", folder, fate=f"{moment} process") == 0, commands.printed
    assert commands.document == whole


WIDTHS = "examinations = 10\nbudget = 3\n[teaching.width]\ntrim = [0.0, 0.3]"
PLV = {**ROOM, "more": WIDTHS, "objective": '"plv"', "parameters": {"trim": "[-0.2, 0.2]"}, "initial": "2"}
SEARCHED = ("training 3", "rule 1", "exam 40", "exam 30", "rule 2")


def test_a_search_by_plv_killed_in_trials_and_finalists_prints_the_same_document(make_study, commands):
    folder = make_mortal(make_study, **PLV)
    assert commands.run("study", folder) == 0, commands.printed
    whole = commands.document
    shutil.rmtree(folder)
    folder = make_mortal(make_study, **PLV)
    ended = kill_at(commands, ("study", folder), SEARCHED, "all", lambda: len(trials(folder)))
    assert ended[:2] == [0, 0], "before the first trial"
    assert {1, 2} & set(ended), "between the first and the last"
    assert ended[-2:] == [3, 3], "within the confirmation"
    assert commands.document == whole


FAMILIES = "[families.right]\n[families.far.parameters]\ntrim = [-0.3, -0.29]\n"
LESSONS = TEACHING.format(grid=ROOM["grid"], more="examinations = 10").split("[teaching.proxies.right]")[0]
TIMES = ("seconds", "episodes", "seconds_per_episode", "seconds_per_episode_interval", "cheapest", "sentence")
"""Keys of what depends on how long something took, or is of this run alone; the sentence tells the cheapest family."""
TUNED = ("episode 10", "episode 50", "training 3", "exam 5", "rule 1")


def make_families(make_study):
    """Two families of a study that teaches, of which the second cannot come near the target."""
    tables = LESSONS.replace("schoolroom:Matrix", "mortal:MortalMatrix") + FAMILIES
    folder = make_several(make_study, families=tables, family=ROOM["family"], proxy='"right.toml"', **SMALL)
    (folder / "twin.toml").write_text("trim = 0.1\ndelay = 0.12\n")
    return folder


def test_families_killed_in_a_search_and_in_lessons_come_to_the_same_but_for_times(make_study, commands):
    folder = make_families(make_study)
    assert commands.run("study", folder) == 0, commands.printed
    whole = json.loads(commands.document)
    homes = [folder / "families" / name for name in ("right", "far")]
    of_right, of_far = (finished_episodes(home) for home in homes)
    shutil.rmtree(folder)
    make_families(make_study)
    kept = kill_at(commands, ("study", folder), TUNED, "all", lambda: [finished_episodes(home) for home in homes])
    assert kept[0] == [9, 0], "within the search of the first family"
    assert kept[1][0] == of_right, "within that of the second"
    assert 0 < kept[1][1] < of_far
    assert kept[2:] == [[of_right, of_far]] * 3, "in its lessons"
    assert but_for(json.loads(commands.document), TIMES) == but_for(whole, TIMES)
