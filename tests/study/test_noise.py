"""Noise is that of placement where both sides share their starts, and what is lost without is told."""

import numpy as np
import pytest

from proxytune.storage.store import Store
from proxytune.study.knowledge import goal_of
from proxytune.study.result import result_of
from proxytune.study.stages.noise import noise_of, shares_starts
from proxytune.study.stages.preflight import placement_pairs, run_preflight
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun


def opened(folder, store):
    study = open_study(folder)
    study_run = StudyRun(study, store)
    run_preflight(study_run)
    return study


def edited(folder, edit):
    target = folder / "target.csv"
    head, *rows = target.read_text().splitlines()
    target.write_text("\n".join([head, *edit(rows)]) + "\n")
    return folder


def means_only(rows):
    """One row an agent, as papers print them."""
    kept = {row.split(",")[0]: row for row in rows}
    return list(kept.values())


def other_starts(rows):
    return [row.replace(",", ",other", 1) for row in rows]


def with_holes(rows):
    return [row for row in rows if not row.startswith("agent2,1,")]


def test_with_shared_starts_noise_is_what_another_placement_changes(make_study):
    folder = make_study(preflight="true")
    with Store.open(folder) as store:
        study = opened(folder, store)
        found, pairs = noise_of(StudyRun(study, store)), placement_pairs(StudyRun(study, store))
    assert found.caution == ""
    assert pairs.shape[1:] == (2, 6, 2)
    # Wobbly's scores wobble by 0.15, so a difference of two means over three starts has a variance of 2 · 0.15² / 3.
    assert np.median(found.variance) == pytest.approx(2 * 0.15**2 / 3, rel=0.8)
    assert (found.variance > 0.0).all()


def test_repeats_of_a_start_on_the_target_make_its_noise_less(make_study):
    folder = make_study(preflight="true")
    with Store.open(folder) as store:
        once = noise_of(StudyRun(opened(folder, store), store))
        edited(folder, twice)
        study = open_study(folder)
        assert shares_starts(study)
        again = noise_of(StudyRun(study, store))
    assert again.variance == pytest.approx(0.75 * once.variance)


def twice(rows):
    """Every start driven twice, labelled START/REPEAT."""
    split = [row.split(",", 2) for row in rows]
    return [f"{agent},{start}/{repeat},{rest}" for agent, start, rest in split for repeat in (0, 1)]


@pytest.mark.slow
@pytest.mark.parametrize("edit", [means_only, other_starts, with_holes])
def test_any_other_table_works_and_says_what_it_loses(finished, edit):
    with Store.read(finished) as store:
        before = result_of(StudyRun(open_study(finished), store))
        assert len(before.cautions) == 1  # this study has no pre-flight
        found = result_of(StudyRun(open_study(edited(finished, edit)), store))
    assert not shares_starts(found.study)
    (caution,) = found.cautions
    assert caution.startswith("noise is ")
    assert "; to know θ better, measure the target" in caution
    assert found.best.trial in found.trials
    for low, high in found.knowledge.intervals.values():
        assert low < high


def test_the_spread_between_starts_is_taken_for_noise_only_where_nothing_better_is_known(make_study):
    folder = make_study(preflight="true")
    with Store.open(folder) as store:
        known = noise_of(StudyRun(opened(folder, store), store))
        unknown = noise_of(StudyRun(open_study(make_study(preflight="false")), store))
    assert known.caution == ""
    assert unknown.caution.startswith("noise is estimated from the spread between the target's episodes")


def test_failed_episodes_of_the_pre_flight_are_left_out(make_study):
    folder = make_study(domain={"faults": '["agent3:1:raises"]'}, preflight="true")
    with Store.open(folder) as store:
        study = opened(folder, store)
        found = noise_of(StudyRun(study, store))
        assert np.array_equal(goal_of(StudyRun(study, store)).noise, found.variance.ravel())
    assert np.isfinite(found.variance).all()
