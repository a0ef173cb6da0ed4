"""What a minute of driving costs, 1 to 48 robots side by side: `python benchmarks/fleets.py [CHECKOUT …]`.

Each checkout, this one if none is named, is measured in processes of its own, in turns, so that all see the same
machine. Times are of the processor, best of ROUNDS; a minute is one that a robot has driven. Bullet is told as a
multiple of its bare steps too: those of the same drives, timed one by one in a run of their own. Code that cannot drive
robots side by side drives them one after the other.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

SIZES = (1, 4, 16, 48)
"""Robots at once: of so many agents as make them with 4 starts each."""

PLANTS, STARTS, ROUNDS = ("planar", "bullet"), 4, 3
SECONDS = 60.0


def measure(plant: str, robots: int, seconds: float) -> dict[str, float]:
    """Milliseconds of the processor's time for a robot-minute, those of Bullet's bare steps, and peak memory [MB]."""
    from proxytune.domain import make_episode
    from proxytune.driving.agents import AGENTS
    from proxytune.driving.family import lane_following
    from proxytune.settings import Section

    with tempfile.TemporaryDirectory() as folder:
        section = Section(Path(folder) / "study.toml", "domain.", {"plant": plant, "seconds": seconds})
        family = lane_following(section, model=None)
    agents = list(AGENTS)[: max(1, robots // STARTS)] if robots > 1 else ["steady"]
    each = min(robots, STARTS)
    episodes = [make_episode({}, agent=agent, start=start, seed=start) for agent in agents for start in range(each)]

    def drive(some: Sequence[Any]) -> float:
        begun = time.process_time()
        many = getattr(family, "run_many", None)
        scores = many(some) if many else [family.run(episode) for episode in some]
        return (time.process_time() - begun) / sum(one["survival_time"] for one in scores) * 6e4

    drive(episodes)  # once for what is loaded and compiled
    found = {"ms": drive(episodes), "mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0}
    return {**found, "bare": _share_of_steps(lambda: drive(episodes)) * found["ms"]} if plant == "bullet" else found


def _share_of_steps(drive: Callable[[], float]) -> float:
    """The share of PyBullet's own steps in the processor's time of drives: what is left if all else cost nothing."""
    import pybullet

    step, spent = pybullet.stepSimulation, 0.0

    def timed(*arguments: Any, **options: Any) -> None:
        nonlocal spent
        begun = time.process_time()
        step(*arguments, **options)
        spent += time.process_time() - begun

    pybullet.stepSimulation = timed
    begun = time.process_time()
    try:
        drive()
    finally:
        pybullet.stepSimulation = step
    return spent / (time.process_time() - begun)


def in_process(checkout: Path, plant: str, robots: int, seconds: float) -> dict[str, float]:
    """What `measure` finds with the code of a checkout."""
    one_core = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    command = [sys.executable, __file__, "--measure", plant, str(robots), str(seconds)]
    where = {**os.environ, **one_core, "PYTHONPATH": str(checkout)}
    done = subprocess.run(command, env=where, cwd=checkout, check=True, capture_output=True, text=True)
    found: dict[str, float] = json.loads(done.stdout)
    return found


def best(rounds: Sequence[dict[str, float]]) -> dict[str, float]:
    """The least of every figure."""
    return {name: min(found[name] for found in rounds) for name in rounds[0]}


def line(found: dict[str, float]) -> str:
    """A measurement in words."""
    told = f"{found['ms']:6.1f} ms a robot-minute, {found['mb']:4.0f} MB"
    return (
        f"{told}, {found['ms'] / found['bare']:.2f} of {found['bare']:.0f} ms of bare steps"
        if "bare" in found
        else told
    )


def main(checkouts: Sequence[str], sizes: Sequence[int] = SIZES, rounds: int = ROUNDS) -> None:
    """Print a line for each plant, number of robots and checkout."""
    places = [Path(one).resolve() for one in checkouts] or [Path(__file__).resolve().parents[1]]
    for plant in PLANTS:
        for robots in sizes:
            turns = [[in_process(one, plant, robots, SECONDS) for one in places] for _ in range(rounds)]
            for place, found in zip(places, zip(*turns, strict=True), strict=True):
                print(f"  {plant:7} {robots:2} robots  {place.name:12} {line(best(found))}", flush=True)


if __name__ == "__main__":
    if "--help" in sys.argv:
        print(__doc__)
        sys.exit()
    if sys.argv[1:2] == ["--measure"]:
        print(json.dumps(measure(sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))))
    else:
        main(sys.argv[1:])
