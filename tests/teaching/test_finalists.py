"""The finalists of a search by PLV are the best by all trials together, none twice, and are taught afresh."""

from dataclasses import replace

import numpy as np
import pytest
from taught import GRID, make_taught

from proxytune.learning.lessons import Distribution
from proxytune.learning.settings import NONE
from proxytune.running.progress import Silent
from proxytune.search.design import from_unit
from proxytune.search.proposer import Trial
from proxytune.study.settings import read_study_settings
from proxytune.teaching.box import search_space
from proxytune.teaching.examining import examine_curves
from proxytune.teaching.experiment import load_setup
from proxytune.teaching.finalists import (
    BEST,
    BOX,
    BY_PRPV,
    SINGLE,
    best_teacher,
    confirm,
    finalists,
    most_examinations,
    saves_more,
)

BOX_KEYS = {"parameters": {"trim": "[-0.3, 0.3]"}}
WIDTH = "[teaching.width]\ntrim = [0.0, 0.4]\n"


def searched(folder, score):
    """A setup, its study, the box, and twenty trials whose score, PLV with its sign turned, is a function of θ."""
    settings = read_study_settings(folder)
    setup = load_setup(settings)
    space = search_space(settings, setup.settings.widths, {})
    points = np.random.default_rng(1).random((20, len(space.names)))
    trials = [Trial(values, score(*values)) for values in (from_unit(space, point) for point in points)]
    return setup, settings, space, trials


def test_centre_and_width_are_those_of_highest_plv_and_the_single_theta_is_the_best_without_a_width(make_study):
    folder = make_taught(make_study, more=WIDTH, **BOX_KEYS)
    found = finalists(*searched(folder, lambda trim, width: (trim - 0.1) ** 2 + (width - 0.2) ** 2), None)
    low, high = found[BEST].bounds["trim"]
    assert (low + high) / 2 == pytest.approx(0.1, abs=0.04)
    assert high - low == pytest.approx(0.2, abs=0.06)
    assert found[SINGLE].fixed
    assert found[SINGLE].centre["trim"] == pytest.approx(0.1, abs=0.1)
    assert found[BOX].bounds == {"trim": (-0.3, 0.3)}


def test_without_widths_there_is_one_theta_beside_the_one_that_prpv_chooses(make_study):
    parts = searched(make_taught(make_study, **BOX_KEYS), lambda trim: (trim + 0.1) ** 2)
    assert finalists(*parts, None).keys() == {SINGLE}
    assert finalists(*parts, {"trim": 0.2})[BY_PRPV].centre == {"trim": 0.2}


def test_what_prpv_chooses_is_no_finalist_of_its_own_where_it_is_the_best_theta(make_study):
    parts = searched(make_taught(make_study, **BOX_KEYS), lambda trim: (trim + 0.1) ** 2)
    best = finalists(*parts, None)[SINGLE].centre
    assert finalists(*parts, best).keys() == {SINGLE}


def test_where_no_proxy_converged_there_is_no_finalist(make_study):
    parts = searched(make_taught(make_study, **BOX_KEYS), lambda trim: None)
    assert finalists(*parts, {"trim": 0.2}) == {}


@pytest.mark.slow
def test_finalists_are_taught_with_lessons_and_examinations_that_the_search_has_not_used(make_study, tmp_path):
    journal = tmp_path / "journal"
    folder = make_taught(make_study, domain={"teaching_journal": f'"{journal}"'}, **BOX_KEYS)
    settings = read_study_settings(folder)
    setup = load_setup(settings)
    named = {
        "right": Distribution({"delay": (0.21, 0.21), "trim": (0.12, 0.12)}),
        "wrong": Distribution({"trim": (-0.3, -0.3)}),
    }
    examine_curves(setup, {NONE: None, **named}, 1, Silent())
    before = set(journal.read_text().splitlines())
    found = confirm(settings, setup, named, Silent()).experiment
    after = journal.read_text().splitlines()[len(before) :]
    assert not before & {line for line in after if line.startswith("exam")} - before
    assert best_teacher(found).name == "right"
    assert saves_more(found, "right", "wrong").low > 0.0


def test_what_a_search_takes_at_most_counts_finalists_twice_where_examinations_are_chosen(make_study):
    def most(more):
        return most_examinations(
            load_setup(read_study_settings(make_taught(make_study, called=more[:8], more=more))).settings
        )

    assert most("budget = 3\nexaminations = 10") == 4 * 10 + 5 * 20
    assert most("budget = 4") == (5 + 5) * 3 * len(GRID)


def test_a_finalist_whose_expert_cannot_drive_is_left_out_with_the_reason(make_study):
    folder = make_taught(make_study, **BOX_KEYS)
    settings = read_study_settings(folder)
    setup = load_setup(settings)
    other = load_setup(read_study_settings(make_taught(make_study, called="blocked", domain={"blocked": "0.9"})))
    found = confirm(
        settings, replace(setup, proxy=other.proxy), {"right": Distribution({"trim": (0.12, 0.12)})}, Silent()
    )
    assert found.experiment.teachers == ()
    assert found.unable["right"].startswith("right: the expert cannot drive here")
