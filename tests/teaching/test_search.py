"""A search by PLV looks where asked, finds the proxy that teaches, and confirms its finalists afresh."""

import re
from dataclasses import replace

import numpy as np
import pytest
from one_line import complaint_of
from taught import GRID, make_taught

from proxytune.errors import RunError, SettingsError
from proxytune.learning import NONE, Distribution
from proxytune.running import Silent
from proxytune.search import Trial, from_unit, make_proposer
from proxytune.storage import Store
from proxytune.study import read_study_settings
from proxytune.teaching import PlvSearch, best_teacher, load_setup, most_examinations, saves_more, search_space
from proxytune.teaching.examining import examine_curves
from proxytune.teaching.points import distribution
from proxytune.teaching.search import BEST, BOX, BY_PRPV, OBJECTIVE, SINGLE, finalists, teach_finalists

BOX_KEYS = {"parameters": {"trim": "[-0.3, 0.3]"}}


def searched(folder, score):
    """A setup, its study, the box, and twenty trials whose score, PLV with its sign turned, is a function of θ."""
    settings = read_study_settings(folder)
    setup = load_setup(settings)
    space = search_space(settings, setup.settings.widths, {})
    points = np.random.default_rng(1).random((20, len(space.names)))
    trials = [Trial(values, score(*values)) for values in (from_unit(space, point) for point in points)]
    return setup, settings, space, trials


def test_centre_and_width_are_those_of_highest_plv_and_the_single_theta_is_the_best_without_a_width(make_study):
    folder = make_taught(make_study, more="[teaching.width]\ntrim = [0.0, 0.4]\n", **BOX_KEYS)
    found = finalists(*searched(folder, lambda trim, width: (trim - 0.1) ** 2 + (width - 0.2) ** 2), None)
    low, high = found[BEST].bounds["trim"]
    assert (low + high) / 2 == pytest.approx(0.1, abs=0.04)
    assert high - low == pytest.approx(0.2, abs=0.06)
    assert found[SINGLE].fixed
    assert found[SINGLE].centre["trim"] == pytest.approx(0.1, abs=0.1)
    assert found[BOX].bounds == {"trim": (-0.3, 0.3)}


def test_there_is_one_theta_without_widths_beside_the_one_that_prpv_chooses_if_that_is_another(make_study):
    parts = searched(make_taught(make_study, **BOX_KEYS), lambda trim: (trim + 0.1) ** 2)
    assert finalists(*parts, None).keys() == {SINGLE}
    assert finalists(*parts, {"trim": 0.2})[BY_PRPV].centre == {"trim": 0.2}
    best = finalists(*parts, None)[SINGLE].centre
    assert finalists(*parts, best).keys() == {SINGLE}
    assert finalists(*parts[:-1], [replace(trial, score=None) for trial in parts[-1]], best) == {}


@pytest.mark.slow
def test_finalists_are_taught_with_lessons_and_examinations_that_the_search_has_not_used(make_study, tmp_path):
    journal = tmp_path / "journal"
    settings = read_study_settings(make_taught(make_study, domain={"teaching_journal": f'"{journal}"'}, **BOX_KEYS))
    setup = load_setup(settings)
    right, wrong = {"delay": (0.21, 0.21), "trim": (0.12, 0.12)}, {"trim": (-0.3, -0.3)}
    named = {"right": Distribution(right), "wrong": Distribution(wrong)}
    examine_curves(setup, {NONE: None, **named}, 1, Silent())
    before = set(journal.read_text().splitlines())
    found, _ = teach_finalists(settings, setup, named, Silent())
    after = journal.read_text().splitlines()[len(before) :]
    assert not before & {line for line in after if line.startswith("exam")} - before
    assert best_teacher(found).name == "right"
    assert saves_more(found, "right", "wrong").low > 0.0


def test_what_a_search_takes_at_most_counts_finalists_twice_where_examinations_are_chosen(make_study):
    def most(more):
        settings = read_study_settings(make_taught(make_study, called=more[:8], more=more))
        return most_examinations(load_setup(settings).settings)

    assert most("budget = 3\nexaminations = 10") == 4 * 10 + 5 * 20
    assert most("budget = 4") == (5 + 5) * 3 * len(GRID)


def test_a_finalist_whose_expert_cannot_drive_is_left_out_with_the_reason(make_study):
    settings = read_study_settings(make_taught(make_study, **BOX_KEYS))
    setup = load_setup(settings)
    other = load_setup(read_study_settings(make_taught(make_study, called="blocked", domain={"blocked": "0.9"})))
    setup, right = replace(setup, proxy=other.proxy), Distribution({"trim": (0.12, 0.12)})
    found, unable = teach_finalists(settings, setup, {"right": right}, Silent())
    assert found.teachers == ()
    assert unable["right"].startswith("right: the expert cannot drive here")


BOXED = {"trim": "[-0.3, 0.3]"}


def run(folder):
    settings = read_study_settings(folder)
    setup = load_setup(settings)
    space = search_space(settings, setup.settings.widths, {})
    with Store.open(folder) as store:
        return PlvSearch(settings, setup, store, space, Silent()).run(make_proposer("gp", settings.initial))


@pytest.mark.slow
def test_it_prefers_a_proxy_from_which_the_target_is_learnt_with_fewest_samples(make_study):
    found = run(make_taught(make_study, parameters=BOXED, more="budget = 6", initial="4"))
    assert len(found.trials) == 6
    assert found.best.worth.plv.value == max(trial.worth.plv.value for trial in found.trials)
    assert found.best.worth.plv.value > min(trial.worth.plv.value for trial in found.trials)
    assert abs(found.best.theta["trim"] - 0.12) < 0.15


@pytest.mark.slow
def test_a_raised_budget_goes_on_after_the_very_same_trials(make_study, tmp_path):
    journal = tmp_path / "journal"
    domain = {"teaching_journal": f'"{journal}"'}
    folder = make_taught(make_study, parameters=BOXED, domain=domain, more="budget = 3", initial="2")
    short, driven = run(folder), len(journal.read_text().splitlines())
    again = run(folder)
    assert len(journal.read_text().splitlines()) == driven
    path = folder / "study.toml"
    path.write_text(path.read_text().replace("budget = 3", "budget = 4"))
    thetas = [[dict(trial.theta) for trial in found.trials] for found in (short, again, run(folder))]
    assert thetas[0] == thetas[1] == thetas[2][:3]
    assert len(thetas[2]) == 4


@pytest.mark.slow
def test_its_trials_are_kept_in_the_study_with_score_and_measures(make_study):
    folder = make_taught(make_study, parameters=BOXED, more="budget = 2", initial="2", grid=GRID[:4])
    found = run(folder)
    with Store.read(folder) as store:
        trials = store.trials(OBJECTIVE)
    assert [trial.theta for trial in trials] == [trial.theta for trial in found.trials]
    assert [trial.measures.get("plv") for trial in trials] == [trial.worth.plv.value for trial in found.trials]
    assert all(trial.score == -trial.measures["plv"] for trial in trials if trial.state == "finished")
    assert found.stopped == "the budget of 2 proxies is spent"


@pytest.mark.slow
def test_a_batch_of_proxies_is_proposed_together_and_resumed_exactly(make_study):
    def set_budget(folder, count):
        path = folder / "study.toml"
        head, teaching = path.read_text().split("[teaching]")
        path.write_text(f"{head}[teaching]{re.sub(r'budget = [0-9]+', f'budget = {count}', teaching)}")

    keys = {"parameters": BOXED, "more": "budget = 4", "initial": "2", "batch": "2"}
    whole, cut = (make_taught(make_study, called=name, **keys) for name in ("whole", "cut"))
    expected = [trial.theta for trial in run(whole).trials]
    set_budget(cut, 3)
    assert [trial.theta for trial in run(cut).trials] == expected[:3]
    set_budget(cut, 4)
    assert [trial.theta for trial in run(cut).trials] == expected


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rule", "reason"),
    [("wall_time_s = 1e-9", "episodes took"), ("no_improvement = 1e9", "no θ is expected to improve PLV")],
)
def test_a_rule_stops_it_and_without_the_rule_it_goes_on(make_study, rule, reason):
    folder = make_taught(make_study, parameters=BOXED, more="budget = 4", initial="2")
    path = folder / "study.toml"
    plain = path.read_text()
    path.write_text(f"{plain}\n[stop]\n{rule}\n")
    found = run(folder)
    assert found.stopped.startswith(reason)
    assert 0 < len(found.trials) < 4
    path.write_text(plain)
    assert [trial.theta for trial in run(folder).trials][: len(found.trials)] == [trial.theta for trial in found.trials]


@pytest.mark.slow
def test_other_settings_of_teaching_begin_its_trials_afresh(make_study):
    folder = make_taught(make_study, parameters=BOXED, more="budget = 2", initial="2", grid=GRID[:4])
    first = run(folder)
    path = folder / "study.toml"
    path.write_text(path.read_text().replace("seeds = 3", "seeds = 2"))
    again = run(folder)
    assert len(again.trials) == 2
    assert again.trials[0].curve.scores.shape[0] == 2 != first.trials[0].curve.scores.shape[0]


@pytest.mark.slow
def test_the_width_of_a_parameter_is_searched_beside_its_centre(make_study):
    width = "budget = 2\n[teaching.width]\ntrim = [0.0, 0.2]\n"
    found = run(make_taught(make_study, parameters=BOXED, more=width, initial="2", grid=GRID[:4]))
    assert found.space.names == ("trim", "trim width")
    for trial in found.trials:
        low, high = trial.proxy.bounds["trim"]
        centre, half = trial.theta["trim"], trial.theta["trim width"] / 2
        assert (low, high) == pytest.approx((max(-0.3, centre - half), min(0.3, centre + half)))
        assert low < high


def test_a_distribution_is_cut_off_at_what_a_parameter_can_be_and_the_search_at_what_prpv_has_left(make_study):
    setup = load_setup(read_study_settings(make_taught(make_study)))
    bounds = distribution(setup, {"trim": 0.25, "trim width": 0.2, "delay": 0.1}).bounds
    assert bounds["trim"] == pytest.approx((0.15, 0.3))
    assert bounds["delay"] == (0.1, 0.1)
    settings = read_study_settings(make_taught(make_study, parameters=BOXED))
    whole = search_space(settings, {}, {})
    left = search_space(settings, {}, {"trim": (0.04, 0.16)})
    pinned = search_space(settings, {}, {"trim": (0.1, 0.1)})
    assert (whole.intervals[0].low, whole.intervals[0].high) == (-0.3, 0.3)
    assert (left.intervals[0].low, left.intervals[0].high) == pytest.approx((0.04, 0.16))
    assert pinned.intervals[0].low < 0.1 < pinned.intervals[0].high
    assert pinned.intervals[0].high - pinned.intervals[0].low == pytest.approx(0.04)


def test_widths_without_a_parameter_or_plv_without_a_target_are_refused(make_study):
    settings = read_study_settings(make_taught(make_study, parameters=BOXED))
    with pytest.raises(SettingsError, match=r"teaching\.width\.delay: is not among \[parameters\]"):
        search_space(settings, {"delay": (0.0, 0.1)}, {})
    with pytest.raises(RunError, match=r"still rises by more than 6 .* PLV is not known; raise teaching\.target"):
        run(make_taught(make_study, parameters=BOXED, grid=[0, 3, 6]))
    with pytest.raises(RunError, match=r"does not come to 64 within 640 samples, .* lower teaching\.level"):
        run(make_taught(make_study, parameters=BOXED, more="level = 70.0"))


@pytest.mark.parametrize(("widest", "wide"), [(0.2001, "0.2001"), (600.0, "600")])
def test_a_width_beyond_the_parameters_box_is_one_line(make_study, widest, wide):
    settings = read_study_settings(make_taught(make_study, parameters={"trim": "[0.1, 0.3]"}))
    path, says = settings.path, f"must be at most 0.2, all of its box in [parameters], got {wide}"
    assert complaint_of(search_space, settings, {"trim": (0.0, widest)}, {}) == f"{path}: teaching.width.trim: {says}"
    assert search_space(settings, {"trim": (0.0, 0.2)}, {}).names == ("trim", "trim width")
