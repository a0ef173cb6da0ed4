"""Each family teaches at its best θ, for one target; what they share is made once."""

from contextlib import nullcontext

import pytest
from several import make_several
from taught import TEACHING

from proxytune.errors import LearnerError, SettingsError
from proxytune.learning.plv import difference
from proxytune.running.progress import Silent
from proxytune.study.settings import read_study_settings
from proxytune.teaching.experiment import load_setup, run_experiment
from proxytune.teaching.families import classrooms, teach_families

GRID = [0, 20, 40, 80, 160, 320, 640]
BLOCKED = "[families.right]\n[families.blocked.domain]\nblocked = 0.9\n"
RIGHT, FAR = {"trim": 0.12, "delay": 0.21}, {"trim": -0.3}


@pytest.fixture
def taught(make_study):
    """A study of several schoolrooms."""

    def make(families="[families.right]\n[families.far]\n", grid=GRID, **changes):
        table = TEACHING.format(grid=grid, more="").split("[teaching.proxies.right]")[0]
        changes = {"family": '"schoolroom:schoolroom"', **changes}
        folder = make_several(make_study, families=table + families, **changes)
        (folder / "twin.toml").write_text("trim = 0.12\ndelay = 0.21\n")
        return read_study_settings(folder)

    return make


def teach(settings, *thetas):
    return teach_families(
        settings, dict(zip(settings.families, thetas, strict=True)), lambda points: nullcontext(Silent())
    )


@pytest.mark.slow
def test_a_family_is_worth_what_teach_says_of_its_best_theta(taught):
    settings = taught()
    lessons = teach(settings, RIGHT, FAR)
    both = "[teaching.proxies.right]\ntrim = 0.12\ndelay = 0.21\n[teaching.proxies.far]\ntrim = -0.3\n"
    settings.path.write_text(f"{settings.path.read_text()}{both}")
    known = read_study_settings(settings.path)
    experiment = run_experiment(known, load_setup(known), Silent())
    for teacher in experiment.teachers:
        assert teacher.worth is not None
        assert lessons[teacher.name].plv == teacher.worth.plv
        assert lessons[teacher.name].needed == teacher.worth.needed
        assert lessons[teacher.name].zero_shot == teacher.zero_shot.value
    right, far = lessons["right"], lessons["far"]
    assert (right.theta, right.more) == (RIGHT, None)
    assert right.plv.value > far.plv.value
    assert far.more == difference(experiment.needs, more="far", less="right")


@pytest.mark.slow
def test_the_learner_without_a_proxy_is_examined_once_for_all_and_nothing_is_made_again(taught, tmp_path):
    journal = tmp_path / "journal"
    settings = taught(domain={"teaching_journal": f'"{journal}"'})
    teach(settings, RIGHT, FAR)
    exams = sum(line.startswith("exam") for line in journal.read_text().splitlines())
    # Three curves, not four, of three repetitions; before its first sample the one without a proxy is not examined.
    assert exams == settings.starts * 3 * (3 * len(GRID) - 1)
    before = journal.read_text()
    teach(settings, RIGHT, FAR)
    assert journal.read_text() == before


def test_a_family_whose_expert_cannot_drive_there_cannot_teach_and_the_others_can(taught):
    lessons = teach(taught(BLOCKED), RIGHT, RIGHT)
    assert lessons["right"].plv is not None
    assert lessons["blocked"].plv is None
    assert "blocked: the expert cannot drive here" in lessons["blocked"].failure


def test_where_none_can_teach_the_first_says_why(taught):
    both = BLOCKED.replace("[families.right]", "[families.shut.domain]\nblocked = 0.8")
    with pytest.raises(LearnerError, match="shut: the expert cannot drive here"):
        teach(taught(both), RIGHT, RIGHT)


def test_a_family_that_is_no_classroom_is_refused_by_its_name(taught):
    settings = taught('[families.right]\n[families.mute]\nfamily = "wobbly:wobbly"\n')
    with pytest.raises(SettingsError, match=r"families\.mute: family: wobbly:wobbly cannot teach: it lacks best_score"):
        classrooms(settings)


def test_a_grid_too_short_to_converge_gives_no_plv(taught):
    lessons = teach(taught(grid=[0, 3, 6]), RIGHT, FAR)
    assert [(one.plv, one.more, one.failure) for one in lessons.values()] == [(None, None, "")] * 2
