"""Examinations are chosen until they are spent, to the same scores wherever a run was broken off."""

import numpy as np
import pytest
from stopping import Killed
from taught import GRID, make_taught, run
from telling import Telling

from proxytune.errors import SettingsError
from proxytune.learning import NONE, Examination, curves_of
from proxytune.running import Silent
from proxytune.study import read_study_settings
from proxytune.teaching import count_examinations, load_setup
from proxytune.teaching.examining import examine_curves

CURVES = 4
CHOSEN = "examinations = 14"


def scores(experiment):
    return {name: curve.scores.tolist() for name, curve in experiment.needs.curves.items()}


def counts(experiment):
    return {name: curve.counts for name, curve in experiment.needs.curves.items()}


@pytest.mark.slow
def test_as_many_examinations_are_made_as_the_study_allows_and_counts_need_not_lie_on_the_grid(make_study):
    found = run(make_taught(make_study, more=CHOSEN))
    assert sum(len(curve.examined) for curve in found.needs.curves.values()) == 14 * CURVES
    assert any(set(each) - set(GRID) for each in counts(found).values())
    assert all(set(GRID) <= set(each) for each in counts(found).values())


class Killer(Telling):
    """Ends the run at its so many-th examination."""

    def __init__(self, last):
        super().__init__()
        self.last = last

    def finished(self, line):
        super().finished(line)
        if len(self.lines) >= self.last:
            raise Killed


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_run_that_is_killed_within_any_batch_goes_on_to_the_same_scores(make_study, jobs):
    whole = run(make_taught(make_study, more=CHOSEN))
    cut = make_taught(make_study, called="cut", more=CHOSEN, jobs=jobs)
    for last in (1, 13, 9, 2):
        with pytest.raises(Killed):
            run(cut, Killer(last))
    again = run(cut)
    assert counts(again) == counts(whole)
    np.testing.assert_equal(scores(again), scores(whole))
    assert [one.worth for one in again.teachers] == [one.worth for one in whole.teachers]


@pytest.mark.slow
def test_more_examinations_go_on_after_the_very_same_ones(make_study, tmp_path):
    journal = tmp_path / "journal"
    folder = make_taught(make_study, more=CHOSEN, domain={"teaching_journal": f'"{journal}"'})
    short, driven = run(folder), len(journal.read_text().splitlines())
    path = folder / "study.toml"
    path.write_text(path.read_text().replace("examinations = 14", "examinations = 17"))
    longer = run(folder)
    assert len(journal.read_text().splitlines()) - driven < driven / 2
    for name, before in short.needs.curves.items():
        after = longer.needs.curves[name]
        kept = {(int(r), before.counts[c]): before.scores[r, c] for r, c in before.examined}
        more = {(int(r), after.counts[c]): after.scores[r, c] for r, c in after.examined}
        assert kept.items() <= more.items()


@pytest.mark.slow
def test_curves_whose_scores_are_known_are_not_examined_further(make_study):
    setup = load_setup(read_study_settings(make_taught(make_study, more=CHOSEN)))
    alone = examine_curves(setup, {NONE: None}, 1, Silent())
    with_proxy = examine_curves(setup, {"right": setup.settings.proxies["right"]}, 1, Silent(), alone)
    assert len(alone) == 14
    assert len(with_proxy) == 28
    assert {one: with_proxy[one] for one in alone} == alone
    assert curves_of(GRID, with_proxy).keys() == {NONE, "right"}


def test_scores_become_curves_over_the_grid_and_what_lies_between():
    curve = curves_of(GRID, {Examination("a", 1, 33): 7.0, Examination("a", 0, 0): 3.0})["a"]
    assert curve.counts == tuple(sorted({*GRID, 33}))
    assert curve.scores[1, curve.counts.index(33)] == 7.0
    assert len(curve.examined) == 2


def test_fewer_examinations_than_at_first_are_refused_and_a_run_is_known_before_it(make_study):
    with pytest.raises(SettingsError, match=r"teaching\.examinations: must be between 8"):
        read_study_settings(make_taught(make_study, more="examinations = 7"))
    assert count_examinations(load_setup(read_study_settings(make_taught(make_study, more=CHOSEN))).settings, 4) == 56
    whole = load_setup(read_study_settings(make_taught(make_study, called="whole"))).settings
    assert count_examinations(whole, 4) == 4 * 3 * len(GRID)
