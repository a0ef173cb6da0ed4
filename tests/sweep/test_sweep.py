import pytest
from telling import Telling

from proxytune.errors import InputError
from proxytune.running.progress import Silent
from proxytune.space import Interval
from proxytune.storage.store import Store
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun
from proxytune.sweep.sweep import all_curves, check_base, curve_of, plan_sweep, run_sweep, sweep_interval

TRUTH = {"trim": 0.1, "delay": 0.12}


def swept(folder, base=TRUTH, parameter="trim", points=5):
    study = open_study(folder)
    plan = plan_sweep(sweep_interval(study, parameter), base, points)
    with Store.open(folder) as store:
        study_run = StudyRun(study, store)
        run_sweep(study_run, plan)
        return study_run.spent.episodes, curve_of(StudyRun(study, store), plan)


def test_a_grid_has_both_ends_and_the_base_s_own_value_once():
    plan = plan_sweep(Interval("trim", -0.3, 0.3), TRUTH, 13)
    assert plan.points[0] == -0.3
    assert plan.points[-1] == 0.3
    assert len(plan.points) == 13, "0.1 is a point of the grid already"
    assert plan_sweep(Interval("trim", -0.3, 0.3), {"trim": 0.12}, 3).points == (-0.3, 0.0, 0.12, 0.3)
    assert plan_sweep(Interval("trim", -0.3, 0.3), {}, 3).points == (-0.3, 0.0, 0.3)


def test_prpv_is_at_its_floor_at_the_truth_and_higher_away_from_it(make_study):
    _, curve = swept(make_study())
    scores = {point.value: point.assessment.prpv.value for point in curve.points}
    assert curve.unit == ""
    assert list(scores) == [-0.3, -0.15, 0.0, 0.1, 0.15, 0.3]
    assert scores[0.1] == 0 < min(scores[-0.3], scores[0.3])


def test_what_is_known_is_not_simulated_again_and_truth_is_shared_between_curves(make_study):
    folder = make_study()
    assert swept(folder)[0] == 6 * 18
    assert swept(folder)[0] == 0
    assert swept(folder, parameter="delay", points=3)[0] == 3 * 18, "four points, of which the truth is known"


def test_the_others_are_nominal_where_nothing_is_said(make_study):
    _, curve = swept(make_study(), base={})
    assert {tuple(point.evaluation.theta) for point in curve.points} == {("trim",)}


def test_every_point_is_told_with_its_place_value_and_prpv(make_study):
    study, telling = open_study(make_study()), Telling()
    with Store.open(study.settings.folder) as store:
        run_sweep(StudyRun(study, store, telling), plan_sweep(sweep_interval(study, "trim"), TRUTH, 3))
        curve = all_curves(StudyRun(study, store))[0]
    scores = [point.assessment.prpv.value for point in curve.points]
    values = ["-0.3", "0", "0.1", "0.3"]
    expected = [(f"trim {n} of 4, at {v}: PRPV {s}") for n, (v, s) in enumerate(zip(values, scores, strict=True), 1)]
    assert telling.lines == expected


class Stopping(Silent):
    def begin(self, what, known):
        if what.startswith("trim 3"):
            raise KeyboardInterrupt


def test_an_interrupted_sweep_goes_on_where_it_was(make_study):
    folder = make_study()
    study = open_study(folder)
    plan = plan_sweep(sweep_interval(study, "trim"), TRUTH, 5)
    with Store.open(folder) as store:
        with pytest.raises(KeyboardInterrupt):
            study_run = StudyRun(study, store, Stopping())
            run_sweep(study_run, plan)
        assert curve_of(StudyRun(study, store), plan) is None
        assert all_curves(StudyRun(study, store)) == []
    assert swept(folder)[0] == 4 * 18
    with Store.read(folder) as store:
        assert [curve.parameter for curve in all_curves(StudyRun(study, store))] == ["trim"]


def test_sweeps_of_a_parameter_that_the_family_no_longer_has_are_left_out(make_study, monkeypatch):
    folder = make_study()
    swept(folder)
    swept(folder, parameter="delay")
    monkeypatch.setattr("wobbly.PARAMETERS", {"delay": open_study(folder).family.parameters["delay"]})
    study = open_study(make_study(parameters={"delay": "[0.0, 0.3]"}))
    with Store.read(folder) as store:
        assert [curve.parameter for curve in all_curves(StudyRun(study, store))] == ["delay"]


def test_a_point_where_an_agent_fails_throughout_has_no_score_but_the_curve_stands(make_study):
    _, curve = swept(make_study(domain={"faults": '["agent3:*:raises"]'}), points=2)
    assert [point.assessment for point in curve.points] == [None, None, None]
    assert "agent 'agent3' failed from every start" in curve.points[0].evaluation.failure


def test_a_parameter_is_swept_over_the_study_s_box_or_else_over_all_it_may_be(make_study):
    study = open_study(make_study(parameters={"trim": "[-0.1, 0.2]"}))
    assert sweep_interval(study, "trim") == Interval("trim", -0.1, 0.2)
    assert sweep_interval(study, "delay") == Interval("delay", 0.0, 0.3)
    with pytest.raises(InputError, match="no parameter 'dely' .*; did you mean 'delay'"):
        sweep_interval(study, "dely")


@pytest.mark.parametrize(
    ("base", "expected"),
    [({"trimm": 0.1}, "did you mean 'trim'"), ({"trim": 0.5}, "must lie within"), ({"trim": float("nan")}, "got nan")],
)
def test_a_base_that_the_family_cannot_take_is_refused(make_study, base, expected):
    with pytest.raises(InputError, match=expected):
        check_base(open_study(make_study()), base)
