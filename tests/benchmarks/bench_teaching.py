"""What teaching costs: `python -m pytest tests/benchmarks/bench_teaching.py -o addopts= -s`. It prints and never fails.

Shares are of cProfile's cumulative seconds, which make Python's own part look larger than it is.
"""

import cProfile
import dataclasses
import functools
import pstats
import time
from collections.abc import Callable
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest

from proxytune.domain import Demonstration, make_episode
from proxytune.driving import BulletPlant, Drivetrain, Expert, GroundPlaneCamera, LaneFollowing, drive, lane_following
from proxytune.driving.cameras import View
from proxytune.driving.expert import Pupil
from proxytune.driving.plants import PlanarFleet, PlanarPlant
from proxytune.learning import Cache, Distribution, collect_samples, policy_of
from proxytune.learning.cloning import BehaviourCloning
from proxytune.settings import Section
from proxytune.study import read_study_settings
from proxytune.teaching import load_setup
from proxytune.teaching.points import Point, TeachingSetup

STUDY = Path(__file__).resolve().parents[2] / "studies" / "teacher"
TWIN = STUDY / "twin.toml"
LESSON_S = 5.0
LEARNER = BehaviourCloning()


def family(plant: str, model: Path | None = None) -> LaneFollowing:
    return lane_following(Section(STUDY / "study.toml", "domain.", {"plant": plant}), model=model)


@functools.cache
def samples(plant: str, count: int) -> Demonstration:
    return collect_samples(family(plant), Distribution({}), count=count, seed=1, lesson_s=LESSON_S)


def timed(work: Callable[[], Any]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def profiled(work: Callable[[], Any]) -> pstats.Stats:
    profile = cProfile.Profile()
    profile.runcall(work)
    return pstats.Stats(profile)


def share(stats: pstats.Stats, part: FunctionType, of: FunctionType | None = None) -> str:
    """The share of one function's cumulative seconds in another's, or in all."""
    whole = cumulative(stats, of) if of else stats.total_tt
    return f"{cumulative(stats, part) / whole:.0%}"


def cumulative(stats: pstats.Stats, function: FunctionType) -> float:
    code = function.__code__
    return float(stats.stats.get((code.co_filename, code.co_firstlineno, code.co_name), (0, 0, 0.0, 0.0))[3])


def tell(capsys: pytest.CaptureFixture[str], *lines: str) -> None:
    with capsys.disabled():
        print("", *lines, sep="\n")


@pytest.mark.parametrize(("plant", "model"), [("bullet", None), ("bullet", TWIN), ("planar", None)])
def test_lessons(capsys, plant, model):
    """The expert drives from ten starts."""
    domain = family(plant, model)
    what = [make_episode({}, agent="expert", start=start, seed=start) for start in range(domain.starts)]
    domain.demonstrate(what[0], 1.0)
    found: list[int] = []
    lessons = lambda: found.extend(len(domain.demonstrate(one, LESSON_S)[0].commands) for one in what)  # noqa: E731
    seconds, kept = timed(lessons), sum(found)
    stats = profiled(lessons)
    tell(
        capsys,
        f"{plant}{' twin' if model else ''}: {seconds / len(what):.3f} s per lesson of {LESSON_S:g} s, "
        f"{kept / seconds:.0f} samples/s, {kept / len(what):.0f} samples kept per lesson",
        f"  of a lesson: picture {share(stats, View.pass_by, drive)}, expert {share(stats, Expert.act, drive)}, "
        f"drivetrain effects {share(stats, Drivetrain.apply, drive)}, plant {share(stats, moves(plant), drive)}",
    )


def moves(plant: str) -> FunctionType:
    return BulletPlant.move if plant == "bullet" else PlanarPlant.move  # type: ignore[return-value]


def test_training(capsys):
    """4000 samples from scratch, then fine-tuning to more and more of them."""
    every = samples("planar", 4000)
    start = LEARNER.train(every, None, 0)
    lines = [told("from scratch", len(every.commands), None, LEARNER.steps * LEARNER.batch, every)]
    for count in (50, 400, 3200):
        part = Demonstration(every.observations[:count], every.commands[:count])
        lines.append(told("fine-tuning", count, start, LEARNER.passes * count, part))
    tell(capsys, *lines)


def told(how: str, count: int, start: Any, through: int, part: Demonstration) -> str:
    seconds = timed(lambda: LEARNER.train(part, start, 0))
    seen = timed(lambda: LEARNER.features(part.observations))
    return (
        f"{how} on {count} samples: {seconds:.2f} s, {through / seconds:.0f} samples/s through the network, "
        f"of which {seen:.2f} s to see them"
    )


@pytest.mark.parametrize(("plant", "model"), [("bullet", TWIN), ("planar", None)])
def test_examination(capsys, plant, model):
    """One drive of a minute by a policy, and where its time goes."""
    policy = functools.partial(LEARNER.act, LEARNER.train(samples(plant, 1000), None, 0))
    domain, what = family(plant, model), make_episode({}, agent="pupil", start=1, seed=0)
    seconds = min(timed(lambda: domain.examine(what, policy)) for _ in range(3))
    stats = profiled(lambda: domain.examine(what, policy))
    tell(
        capsys,
        f"{plant}{' twin' if model else ''}: {seconds:.2f} s per examination of {domain.seconds:g} s",
        f"  picture {share(stats, View.pass_by, drive)} "
        f"(rendering {share(stats, GroundPlaneCamera.render, drive)}, "
        f"image effects {share(stats, View._develop, drive)}), "
        f"answer {share(stats, Pupil.act, drive)} (features {share(stats, BehaviourCloning.features, drive)}), "
        f"drivetrain effects {share(stats, Drivetrain.apply, drive)}, plant {share(stats, moves(plant), drive)}",
    )


@pytest.mark.parametrize(("plant", "model"), [("bullet", TWIN), ("planar", TWIN)])
def test_examination_of_ten_starts(capsys, plant, model):
    """One after the other, and side by side."""
    policy = policy_of(LEARNER, LEARNER.train(samples(plant, 1000), None, 0))
    domain = family(plant, model)
    what = [make_episode({}, agent="pupil", start=start, seed=start) for start in range(domain.starts)]
    alone = timed(lambda: [domain.examine(one, policy) for one in what])
    together = min(timed(lambda: domain.examine_together(what, policy)) for _ in range(3))
    stats = profiled(lambda: domain.examine_together(what, policy))
    tell(
        capsys,
        f"{plant} twin: {alone:.2f} s for {len(what)} starts one after the other, {together:.2f} s side by side",
        f"  pictures {share(stats, View.pass_by)} (rendering {share(stats, GroundPlaneCamera.render)}), "
        f"answers {share(stats, BehaviourCloning.act_many)}, drivetrain effects {share(stats, Drivetrain.apply)}, "
        f"plant {share(stats, BulletPlant.move if plant == 'bullet' else PlanarFleet.move)}",
    )


def test_learning_curve(tmp_path, capsys):
    """One proxy, one seed, the eight counts of studies/teacher, with nothing in the cache."""
    opened = load_setup(read_study_settings(STUDY))
    setup = dataclasses.replace(opened, cache=Cache(tmp_path))
    proxy = setup.settings.proxies["pitch 19°"]
    counts = setup.settings.target_samples
    stats = profiled(lambda: [setup.score(Point("pitch 19°", proxy, 0, count)) for count in counts])
    tell(
        capsys,
        f"learning curve of {len(counts)} counts × {setup.starts} starts: {stats.total_tt:.1f} s, profiled",
        f"  demonstrate {share(stats, LaneFollowing.demonstrate)}, train {share(stats, BehaviourCloning.train)}, "
        f"examine {share(stats, LaneFollowing.examine_together)}, all of it {share(stats, TeachingSetup.score)}",
    )
