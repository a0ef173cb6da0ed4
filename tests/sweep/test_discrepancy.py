import pickle
from dataclasses import replace

import numpy as np
import pytest

from proxytune.domain import make_episode
from proxytune.errors import InputError
from proxytune.running.progress import Silent
from proxytune.storage.store import Store
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun
from proxytune.sweep.curves import series_of
from proxytune.sweep.discrepancy import COMMANDS, METRICS, discrepancy_study
from proxytune.sweep.sweep import curve_of, plan_sweep, pod_mean, run_sweep, sweep_interval, with_target

TRUTH = {"trim": 0.1, "delay": 0.12}


@pytest.fixture
def truth(tmp_path):
    path = tmp_path / "truth.toml"
    path.write_text("trim = 0.1\ndelay = 0.12\n")
    return path


@pytest.fixture
def opened(make_study, truth):
    study = open_study(make_study(family='"echo:echo"'))
    return study, discrepancy_study(study, truth)


def swept(study, discrepancy, points=4):
    plan = plan_sweep(sweep_interval(study, "trim"), TRUTH, points)
    if discrepancy:
        plan = with_target(plan, study.settings.folder.parent / "truth.toml", discrepancy)
    with Store.open(study.settings.folder) as store:
        study_run = StudyRun(study, store)
        run_sweep(study_run, plan, discrepancy)
        spent = study_run.spent
        return spent.episodes, curve_of(StudyRun(study, store), plan)


def test_pod_is_nothing_at_the_truth_and_something_beside_it(opened):
    both = opened[1].family
    at = make_episode(TRUTH, agent="agent0", start=0, seed=3)
    assert both.run(at) == {"pod_pose": 0.0, "pod_image": 0.0}
    off = both.run(make_episode({"trim": -0.1}, agent="agent0", start=0, seed=3))
    assert off["pod_pose"] > 0
    assert off["pod_image"] == pytest.approx(20 / 255), "100 and 120 of 255 grey"


def test_at_most_so_many_commands_are_replayed_and_fewer_where_the_episode_ended(opened):
    both = opened[1].family
    counted = []

    class Counting:
        identity = "counting"

        def drive(self, episode):
            return both.target.drive(episode)

        def replay(self, episode, commands):
            counted.append(len(commands))
            return both.target.replay(episode, commands)

    for start in (0, 2):
        replace(both, proxy=Counting(), target=Counting()).run(make_episode({}, agent="agent0", start=start, seed=3))
    assert counted == [COMMANDS, COMMANDS, 3, 3], "target and proxy in turn"


def test_the_time_after_a_domain_has_ended_is_left_out(opened):
    both = opened[1].family
    found = both.run(make_episode({"trim": 0.3}, agent="agent0", start=0, seed=3))
    assert np.isfinite(list(found.values())).all()


def test_the_target_is_driven_once_per_start_however_many_points(opened):
    drives = []

    class Journal:
        def drive(self, episode):
            drives.append(episode)
            return opened[1].family.target.drive(episode)

        def replay(self, episode, commands):
            return opened[1].family.target.replay(episode, commands)

    both = replace(opened[1].family, target=Journal())
    for trim in (-0.1, 0.0, 0.1):
        both.run(make_episode({"trim": trim}, agent="agent0", start=0, seed=3))
    assert drives == [make_episode({}, agent="agent0", start=0, seed=3)]


def test_identity_tells_targets_and_proxies_apart_and_travels(opened, tmp_path):
    study, discrepancy = opened
    other = tmp_path / "other.toml"
    other.write_text("trim = 0.2\n")
    assert discrepancy_study(study, other).identity != discrepancy.identity != study.identity
    assert pickle.loads(pickle.dumps(discrepancy.family)).identity == discrepancy.identity


def test_a_curve_has_pod_at_every_point_kept_like_other_episodes(opened):
    episodes, curve = swept(*opened)
    assert episodes == 4 * (18 + 3), "the first agent's replays from three starts besides 18 episodes"
    again, same = swept(*opened)
    assert (again, [point.pod for point in same.points]) == (0, [point.pod for point in curve.points])
    assert swept(opened[0], None)[0] == 0
    assert [point.pod["pod_pose"].value == 0 for point in curve.points] == [False, False, True, False]
    assert {point.pod["pod_image"].starts for point in curve.points} == {3}
    assert {one.key for one in series_of(curve)} >= set(METRICS)


def test_a_sweep_stopped_before_its_last_replays_has_no_curve_yet(opened):
    study, discrepancy = opened

    class Stopping(Silent):
        def begin(self, what, known):
            if what.startswith("POD, trim 4"):
                raise KeyboardInterrupt

    model = study.settings.folder.parent / "truth.toml"
    plan = with_target(plan_sweep(sweep_interval(study, "trim"), TRUTH, 4), model, discrepancy)
    with Store.open(study.settings.folder) as store:
        with pytest.raises(KeyboardInterrupt):
            study_run = StudyRun(study, store, Stopping())
            run_sweep(study_run, plan, discrepancy)
        assert curve_of(StudyRun(study, store), plan) is None
        assert curve_of(StudyRun(study, store), replace(plan, replays="")) is not None, "only POD is missing"
    assert swept(study, discrepancy)[0] == 3


def test_several_processes_find_the_same(make_study, truth, opened):
    alone = swept(*opened)[1]
    study = open_study(make_study("other", family='"echo:echo"', jobs="2"))
    together = swept(study, discrepancy_study(study, truth))[1]
    assert [point.pod for point in together.points] == [point.pod for point in alone.points]


def test_starts_from_which_the_agent_fails_are_left_out_of_the_mean(make_study, truth):
    study = open_study(make_study(family='"echo:echo"', domain={"faults": '["agent0:1:raises"]'}))
    _, curve = swept(study, discrepancy_study(study, truth), points=2)
    assert {point.pod["pod_pose"].starts for point in curve.points} == {2}


def test_the_interval_over_starts_holds_the_mean_and_one_start_has_none():
    found = pod_mean([0.1, 0.2, 0.4])
    assert found.value == pytest.approx(0.7 / 3)
    assert 0.0999 < found.interval[0] < found.value < found.interval[1] < 0.4001
    assert pod_mean([0.3]).interval is None
    assert pod_mean([0.0, 0.0]).interval == (0.0, 0.0)


def test_a_family_that_cannot_replay_is_refused_in_one_line(make_study, truth):
    with pytest.raises(InputError, match="wobbly:wobbly has no `drive` and `replay`.*leave the option out"):
        discrepancy_study(open_study(make_study()), truth)


def test_a_missing_model_is_refused(opened, tmp_path):
    with pytest.raises(InputError, match="--target-model .*no.toml: no such file"):
        discrepancy_study(opened[0], tmp_path / "no.toml")


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
    rows = [
        f"{agent},{start},{1 + start}.{place},2.0"
        for place, agent in enumerate(("steady", "drifter"))
        for start in (0, 1)
    ]
    (tmp_path / "target.csv").write_text("\n".join(["agent,episode,distance,survival_time", *rows]) + "\n")
    (tmp_path / "truth.toml").write_text('format = 1\nrobot = "duckiebot"\n[effects.trim]\ntrim = 0.1\n')
    both = discrepancy_study(open_study(tmp_path), tmp_path / "truth.toml").family
    found = [both.run(make_episode({"trim": trim}, agent="steady", start=0, seed=5)) for trim in (0.1, 0.0, -0.2)]
    poses, images = ([one[name] for one in found] for name in METRICS)
    assert poses[0] == 0 == images[0]
    assert 0 < poses[1] < poses[2]
    assert 0 < images[1] < 1
