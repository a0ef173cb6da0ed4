import pickle
from dataclasses import replace
from unittest.mock import Mock, call

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from one_line import complaint_of
from stopping import Stopping
from telling import Telling

from proxytune import sweep
from proxytune.domain import make_episode
from proxytune.space import Interval
from proxytune.storage import Store
from proxytune.study import StudyRun, open_study
from proxytune.usefulness import ALL, PRPV

TRUTH = {"trim": 0.1, "delay": 0.12}


@pytest.fixture
def truth(write_file):
    return write_file("trim = 0.1\ndelay = 0.12\n", "truth.toml")


@pytest.fixture
def opened(make_study, truth):
    study = open_study(make_study(family='"echo:echo"'))
    return study, sweep.discrepancy_study(study, truth)


def swept(study, discrepancy, points=4, base=TRUTH, parameter="trim"):
    plan = sweep.plan_sweep(sweep.sweep_interval(study, parameter), base, points)
    if discrepancy:
        plan = sweep.with_target(plan, study.settings.folder.parent / "truth.toml", discrepancy)
    with Store.open(study.settings.folder) as store:
        study_run = StudyRun(study, store)
        sweep.run_sweep(study_run, plan, discrepancy)
        return study_run.spent.episodes, sweep.curve_of(StudyRun(study, store), plan)


def test_pod_is_nothing_at_the_truth_and_the_target_is_driven_once_per_start(opened):
    both = opened[1].family
    assert both.run(make_episode(TRUTH, agent="agent0", start=0, seed=3)) == {"pod_pose": 0.0, "pod_image": 0.0}
    off = both.run(make_episode({"trim": -0.1}, agent="agent0", start=0, seed=3))
    assert off["pod_pose"] > 0
    assert off["pod_image"] == pytest.approx(20 / 255), "100 and 120 of 255 grey"
    target = Mock(wraps=opened[1].family.target)
    both = replace(opened[1].family, target=target)
    for trim in (-0.1, 0.0, 0.1):
        both.run(make_episode({"trim": trim}, agent="agent0", start=0, seed=3))
    assert target.drive.mock_calls == [call(make_episode({}, agent="agent0", start=0, seed=3))]


def test_replays_end_with_the_commands_or_the_episode_of_either_domain(opened):
    both = opened[1].family
    counting = Mock(wraps=both.target, identity="counting")
    for start in (0, 2):
        replace(both, proxy=counting, target=counting).run(make_episode({}, agent="agent0", start=start, seed=3))
    counted = [len(one.args[1]) for one in counting.replay.mock_calls]
    assert counted == [sweep.COMMANDS, sweep.COMMANDS, 3, 3], "target and proxy in turn"
    assert np.isfinite(list(both.run(make_episode({"trim": 0.3}, agent="agent0", start=0, seed=3)).values())).all()


def test_identity_tells_targets_and_proxies_apart_and_travels_and_a_missing_model_is_refused(opened, tmp_path):
    study, discrepancy = opened
    other = tmp_path / "other.toml"
    other.write_text("trim = 0.2\n")
    assert sweep.discrepancy_study(study, other).identity != discrepancy.identity != study.identity
    assert pickle.loads(pickle.dumps(discrepancy.family)).identity == discrepancy.identity
    path = tmp_path / "no.toml"
    assert f"--target-model {path}: no such file" in complaint_of(sweep.discrepancy_study, opened[0], path)


def test_a_curve_has_pod_at_every_point_kept_like_other_episodes(opened):
    episodes, curve = swept(*opened)
    assert episodes == 4 * (18 + 3), "the first agent's replays from three starts besides 18 episodes"
    again, same = swept(*opened)
    assert (again, [point.pod for point in same.points]) == (0, [point.pod for point in curve.points])
    assert swept(opened[0], None)[0] == 0
    assert [point.pod["pod_pose"].value == 0 for point in curve.points] == [False, False, True, False]
    assert {point.pod["pod_image"].starts for point in curve.points} == {3}
    assert {one.key for one in sweep.series_of(curve)} >= set(sweep.METRICS)


def test_a_sweep_stopped_before_its_last_replays_has_no_curve_yet(opened):
    study, discrepancy = opened

    model = study.settings.folder.parent / "truth.toml"
    plan = sweep.with_target(sweep.plan_sweep(sweep.sweep_interval(study, "trim"), TRUTH, 4), model, discrepancy)
    with Store.open(study.settings.folder) as store:
        with pytest.raises(KeyboardInterrupt):
            sweep.run_sweep(StudyRun(study, store, Stopping(before="POD, trim 4")), plan, discrepancy)
        assert sweep.curve_of(StudyRun(study, store), plan) is None
        assert sweep.curve_of(StudyRun(study, store), replace(plan, replays="")) is not None, "only POD is missing"
    assert swept(study, discrepancy)[0] == 3


@pytest.mark.slow
def test_several_processes_find_the_same(make_study, truth, opened):
    alone = swept(*opened)[1]
    study = open_study(make_study("other", family='"echo:echo"', jobs="2"))
    together = swept(study, sweep.discrepancy_study(study, truth))[1]
    assert [point.pod for point in together.points] == [point.pod for point in alone.points]


def test_starts_from_which_the_agent_fails_are_left_out_and_the_interval_holds_the_mean(make_study, truth):
    study = open_study(make_study(family='"echo:echo"', domain={"faults": '["agent0:1:raises"]'}))
    _, curve = swept(study, sweep.discrepancy_study(study, truth), points=2)
    assert {point.pod["pod_pose"].starts for point in curve.points} == {2}
    found = sweep.pod_mean([0.1, 0.2, 0.4])
    assert found.value == pytest.approx(0.7 / 3)
    assert 0.0999 < found.interval[0] < found.value < found.interval[1] < 0.4001
    assert sweep.pod_mean([0.3]).interval is None
    assert sweep.pod_mean([0.0, 0.0]).interval == (0.0, 0.0)


REAL = """format = 1
target = "target.csv"
metrics = ["distance:max", "survival_time:max"]
agents = ["steady", "drifter"]
starts = 2
budget = 2
seed = 1
[parameters]
trim = [-0.3, 0.3]
[domain]
robot = "duckiebot"
plant = "planar"
seconds = 2.0
"""


def test_a_lane_follower_s_pod_is_nothing_at_the_truth_and_grows_with_trim(tmp_path):
    (tmp_path / "study.toml").write_text(REAL)
    rows = [f"{agent},{start},{1 + start}.{n},2.0" for n, agent in enumerate(("steady", "drifter")) for start in (0, 1)]
    (tmp_path / "target.csv").write_text("\n".join(["agent,episode,distance,survival_time", *rows]) + "\n")
    (tmp_path / "truth.toml").write_text('format = 1\nrobot = "duckiebot"\n[effects.trim]\ntrim = 0.1\n')
    both = sweep.discrepancy_study(open_study(tmp_path), tmp_path / "truth.toml").family
    found = [both.run(make_episode({"trim": trim}, agent="steady", start=0, seed=5)) for trim in (0.1, 0.0, -0.2)]
    poses, images = ([one[name] for one in found] for name in sweep.METRICS)
    assert poses[0] == 0 == images[0]
    assert 0 < poses[1] < poses[2]
    assert 0 < images[1] < 1


def swept_of_sweep(folder, base=TRUTH, parameter="trim", points=5):
    return swept(open_study(folder), None, points, base, parameter)


def test_a_grid_has_both_ends_and_the_base_s_own_value_once():
    plan = sweep.plan_sweep(Interval("trim", -0.3, 0.3), TRUTH, 13)
    assert plan.points[0] == -0.3
    assert plan.points[-1] == 0.3
    assert len(plan.points) == 13, "0.1 is a point of the grid already"
    assert sweep.plan_sweep(Interval("trim", -0.3, 0.3), {"trim": 0.12}, 3).points == (-0.3, 0.0, 0.12, 0.3)
    assert sweep.plan_sweep(Interval("trim", -0.3, 0.3), {}, 3).points == (-0.3, 0.0, 0.3)


def test_the_others_are_nominal_unless_said_and_prpv_is_at_its_floor_at_the_truth(make_study):
    _, curve = swept_of_sweep(make_study())
    scores = {point.value: point.assessment.prpv.value for point in curve.points}
    assert curve.unit == ""
    assert list(scores) == [-0.3, -0.15, 0.0, 0.1, 0.15, 0.3]
    assert scores[0.1] == 0 < min(scores[-0.3], scores[0.3])
    _, curve = swept_of_sweep(make_study(), base={})
    assert {tuple(point.evaluation.theta) for point in curve.points} == {("trim",)}


def test_what_is_known_is_not_simulated_again_and_truth_is_shared_between_curves(make_study):
    folder = make_study()
    assert swept_of_sweep(folder)[0] == 6 * 18
    assert swept_of_sweep(folder)[0] == 0
    assert swept_of_sweep(folder, parameter="delay", points=3)[0] == 3 * 18, "four points, of which the truth is known"


def test_every_point_is_told_with_its_place_value_and_prpv(make_study):
    study, telling = open_study(make_study()), Telling()
    with Store.open(study.settings.folder) as store:
        sweep.run_sweep(
            StudyRun(study, store, telling), sweep.plan_sweep(sweep.sweep_interval(study, "trim"), TRUTH, 3)
        )
        curve = sweep.all_curves(StudyRun(study, store))[0]
    scores = [point.assessment.prpv.value for point in curve.points]
    values = ["-0.3", "0", "0.1", "0.3"]
    expected = [(f"trim {n} of 4, at {v}: PRPV {s}") for n, (v, s) in enumerate(zip(values, scores, strict=True), 1)]
    assert telling.lines == expected


def test_an_interrupted_sweep_goes_on_where_it_was(make_study):
    folder = make_study()
    study = open_study(folder)
    plan = sweep.plan_sweep(sweep.sweep_interval(study, "trim"), TRUTH, 5)
    with Store.open(folder) as store:
        with pytest.raises(KeyboardInterrupt):
            sweep.run_sweep(StudyRun(study, store, Stopping(before="trim 3")), plan)
        assert sweep.curve_of(StudyRun(study, store), plan) is None
        assert sweep.all_curves(StudyRun(study, store)) == []
    assert swept_of_sweep(folder)[0] == 4 * 18
    with Store.read(folder) as store:
        assert [curve.parameter for curve in sweep.all_curves(StudyRun(study, store))] == ["trim"]


@pytest.mark.slow
def test_sweeps_of_a_parameter_that_the_family_no_longer_has_are_left_out(make_study, monkeypatch):
    folder = make_study()
    swept_of_sweep(folder)
    swept_of_sweep(folder, parameter="delay")
    monkeypatch.setattr("wobbly.PARAMETERS", {"delay": open_study(folder).family.parameters["delay"]})
    study = open_study(make_study(parameters={"delay": "[0.0, 0.3]"}))
    with Store.read(folder) as store:
        assert [curve.parameter for curve in sweep.all_curves(StudyRun(study, store))] == ["delay"]


def test_a_point_where_an_agent_fails_throughout_has_no_score_but_the_curve_stands(make_study):
    _, curve = swept_of_sweep(make_study(domain={"faults": '["agent3:*:raises"]'}), points=2)
    assert [point.assessment for point in curve.points] == [None, None, None]
    assert "agent 'agent3' failed from every start" in curve.points[0].evaluation.failure


def test_a_parameter_is_swept_over_the_study_s_box_or_else_over_all_it_may_be(make_study):
    study = open_study(make_study(parameters={"trim": "[-0.1, 0.2]"}))
    assert sweep.sweep_interval(study, "trim") == Interval("trim", -0.1, 0.2)
    assert sweep.sweep_interval(study, "delay") == Interval("delay", 0.0, 0.3)
    assert "no parameter 'dely' in" in complaint_of(sweep.sweep_interval, study, "dely")


@pytest.mark.parametrize(
    ("base", "expected"),
    [
        ({"trimm": 0.1}, "did you mean 'trim'"),
        ({"trim": 0.5}, "must lie within"),
        ({"trim": float("nan")}, "got nan"),
        ({"trim": "0"}, "number"),
    ],
)
def test_a_base_that_the_family_cannot_take_is_refused(make_study, base, expected):
    assert expected in complaint_of(sweep.check_base, open_study(make_study()), base)


def series(scores, spread=0.0, higher=False):
    found = {
        float(place): sweep.Measured(
            score, None if score is None or spread is None else (score - spread, score + spread)
        )
        for place, score in enumerate(scores)
    }
    return sweep.Series(replace(PRPV, better="higher" if higher else "lower"), ALL, found)


VALLEY = series([9.0, 4.0, 1.0, 3.0, 8.0])
SHAPES = {
    "a valley at the held value worsens on both sides": (VALLEY, 2.0, (2.0,), "worsens", "worsens", True),
    "where higher is better the best is a peak": (
        series([0.2, 0.5, 0.9, 0.6, 0.1], higher=True), 2.0, (2.0,), "worsens", "worsens", True,
    ),
    "a second valley turns on its side": (series([9.0, 4.0, 1.0, 6.0, 3.0]), 2.0, (2.0,), "worsens", "turns", False),
    "a best one beside the held one turns": (series([9.0, 4.0, 2.0, 0.0, 8.0]), 2.0, (3.0,), "worsens", "turns", False),
    "a dip within noise is no turn": (
        series([9.0, 4.0, 1.0, 6.0, 5.0], 0.6), 2.0, (2.0,), "worsens", "worsens", True,
    ),
    "a rise within noise is flat": (series([2.0, 1.5, 1.0, 1.5, 2.0], 0.6), 2.0, (2.0,), "flat", "flat", False),
    "without intervals no side is judged": (series([9.0, 1.0, 8.0], None), 1.0, (1.0,), "unknown", "unknown", None),
    "sides need a held value": (series([9.0, 1.0, 8.0]), None, (1.0,), "unseen", "unseen", None),
    "it has to have been looked at": (series([9.0, 1.0, 8.0]), 7.0, (1.0,), "unseen", "unseen", None),
    "at an end it has one side": (series([1.0, 2.0, 3.0]), 0.0, (0.0,), "unseen", "worsens", True),
    "undefined points are passed over": (
        series([9.0, None, 1.0, None, 8.0]), 2.0, (2.0,), "worsens", "worsens", True,
    ),
    "of undefined points alone none is best": (series([None, None]), 0.0, (), "unseen", "unseen", None),
    "ties for the best are all named": (series([3.0, 1.0, 1.0, 2.0]), None, (1.0, 2.0), "unseen", "unseen", None),
}  # fmt: skip


@pytest.mark.parametrize(("curve", "held", "best", "below", "above", "monotone"), SHAPES.values(), ids=SHAPES)
def test_a_curve_has_a_best_value_and_a_shape_on_either_side_of_the_held_one(curve, held, best, below, above, monotone):
    shape = sweep.shape_of(curve, held)
    assert (shape.best, shape.below, shape.above, shape.monotone) == (best, below, above, monotone)


def test_the_score_of_a_shape_and_its_line_say_what_each_side_does():
    assert (sweep.shape_of(VALLEY, 2.0).score, sweep.shape_of(VALLEY, 2.0).near_best) == (1.0, (2.0,))
    assert sweep.shape_of(series([2.0, 1.5, 1.0, 1.5, 2.0], 0.6), 2.0).near_best == (0.0, 1.0, 2.0, 3.0, 4.0)
    assert sweep.shape_of(series([0.2, 0.9, 0.1], higher=True), 1.0).score == 0.9
    line = sweep.describe_shape(series([9.0, 4.0, 1.0, 6.0, 3.0]), 2.0)
    assert line.startswith("PRPV: lowest (1) at 2; not worse beyond noise: 2; from 2 downwards it worsens")
    assert "upwards it turns" in line
    assert sweep.describe_shape(series([None, None]), 0.0) == "PRPV: undefined at every point"
    assert "from" not in sweep.describe_shape(series([9.0, 4.0, 1.0]), None)
    assert "not worse beyond noise: 0, 2" in sweep.describe_shape(series([1.0, 5.0, 1.0]), None)
    wide = series([1.0, 5.0, 1.2, 3.0], 0.6)
    untold = replace(wide, estimates={**wide.estimates, 3.0: sweep.Measured(3.0, None)})
    assert "not worse beyond noise: 0, 2 (noise not known at 3)" in sweep.describe_shape(untold, None)
    assert (sweep.shape_of(untold, None).near_best, sweep.shape_of(untold, None).worse) == ((0.0, 2.0), (1.0,))
    assert sweep.shape_of(series([1.0, 5.0], None), None).near_best == (0.0,)


def test_what_is_beyond_noise_of_one_of_the_best_is_worse():
    tied = series([1.0, 2.6, 1.0, 4.0], 0.6)
    vague = replace(tied, estimates={**tied.estimates, 2.0: sweep.Measured(1.0, (0.0, 9.0))})
    shape = sweep.shape_of(vague, None)
    assert (shape.best, shape.near_best, shape.worse) == ((0.0, 2.0), (0.0, 2.0), (1.0, 3.0))


@settings(max_examples=50)
@given(st.lists(st.floats(-5, 5), min_size=3, max_size=9), st.data())
def test_the_mirror_image_of_a_curve_has_mirrored_sides(scores, data):
    held = data.draw(st.integers(0, len(scores) - 1))
    one = sweep.shape_of(series(scores, 0.5), float(held))
    other = sweep.shape_of(series(scores[::-1], 0.5), float(len(scores) - 1 - held))
    upside_down = sweep.shape_of(series([-score for score in scores], 0.5, higher=True), float(held))
    assert (one.below, one.above) == (other.above, other.below) == (upside_down.below, upside_down.above)


@pytest.mark.parametrize("option", ["--at", "--theta"])
def test_a_study_of_plv_has_no_best_theta_and_running_it_is_no_remedy(make_study, option):
    folder = make_study(objective='"plv"')
    told = complaint_of(sweep.best_theta, open_study(folder), option)
    problem = "is a study of 'plv', which tells its best teacher in report.html and no best θ"
    assert told == f"{folder}: {problem}; give θ itself: {option} NAME=VALUE,NAME=VALUE"
