"""How often the intervals of a study's answer hold: `python benchmarks/interval_coverage.py TABLES [--plant bullet]`.

Five targets of the planar plant, or of Bullet, drawn at random, each with three proxies (itself, one near, one
mediocre), are driven by quickstart's twelve agents again and again; TABLES (.npz) keeps the episodes and is made if it
is not there, about six minutes of processor time (Bullet: half an hour). A split draws a study from them, each cell
(agent, start) by itself: a target, own and fresh episodes of candidates, a pre-flight's pairs, and repetitions that
nothing was chosen by. What the intervals claim to hold is the mean over all that the episodes can come to. Prints a
table in Markdown.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from proxytune.arrays import Floats
from proxytune.running import run_fleet
from proxytune.scores import Metric, ScoreTable
from proxytune.seeds import fresh_seed
from proxytune.study import open_study, plan_episodes
from proxytune.usefulness import Expectation, donors_of, expect, ppv_of_means, prpv_of_means

QUICKSTART = Path(__file__).parent.parent / "studies" / "quickstart"
NAMES = ("trim", "delay", "blur", "camera_pitch")
KINDS = ("itself", "near", "mediocre")
TARGETS, REPEATS, STARTS = 5, (10, 6, 4), 10
AWAY = {"itself": 0.0, "near": 0.04, "mediocre": 0.15}
"""In widths of the box, along a direction drawn at random."""


def thetas(target: int) -> list[dict[str, float]]:
    """The target's θ as a Duckiebot might have it, and those of its proxies, in the order of KINDS."""
    rng = np.random.default_rng((2026, target))
    low, high = np.array([-0.3, 0.0, 0.0, 3.0]), np.array([0.3, 0.3, 0.1, 35.0])
    own = np.array([rng.normal(0.0, 0.06), rng.uniform(0.05, 0.2), rng.uniform(0.02, 0.08), rng.normal(20.0, 3.0)])
    direction = rng.choice([-1.0, 1.0], 4) * rng.uniform(0.5, 1.5, 4)
    points = [np.clip(own + AWAY[kind] * direction * (high - low), low, high) for kind in KINDS]
    return [dict(zip(NAMES, map(float, point), strict=True)) for point in points]


def read_tables(path: Path) -> dict[str, Floats]:
    """The tables so far; none of a file that is not there."""
    if not path.exists():
        return {}
    with np.load(path) as known:
        return dict(known)


def drive_tables(path: Path, plant: str) -> None:
    """Drive what is left, every θ again and again, and keep the metrics (repeats, agents, starts, metrics) of each."""
    study = open_study(QUICKSTART)
    family = replace(study.family, plant=plant)  # type: ignore[type-var]
    settings = replace(study.settings, starts=STARTS)
    names = [metric.name for metric in settings.metrics]

    def table(theta: dict[str, float], seed: int) -> Floats:
        outcomes = run_fleet(family, plan_episodes(settings, theta, seed))
        values = [[(one.metrics or {}).get(name, np.nan) for name in names] for one in outcomes]
        return np.array(values).reshape(len(settings.agents), STARTS, len(names))

    centre = {"trim": 0.0, "delay": 0.15, "blur": 0.05, "camera_pitch": 19.0}
    kept = read_tables(path) or {"centre": np.stack([table(centre, fresh_seed(9, repeat)) for repeat in range(2)])}
    for target in range(len(kept) // len(KINDS), TARGETS):
        for place, (kind, theta, repeats) in enumerate(zip(KINDS, thetas(target), REPEATS, strict=True)):
            seeds = [fresh_seed(1000 * (target + 1) + 100 * place, repeat) for repeat in range(repeats)]
            kept[f"{target} {kind}"] = np.stack([table(theta, seed) for seed in seeds])
        np.savez_compressed(path, **kept)
        print(f"{path}: {target + 1} of {TARGETS} targets", file=sys.stderr, flush=True)


RIVALS = {"itself": "near", "near": "itself", "mediocre": "near"}
"""The other θ that was driven twice as a candidate."""
REPETITIONS, NEXT, PLACES = 5, 300, 2
"""Fresh tables that nothing was chosen by; tables that say what is true; starts of the pre-flight."""
CLAIMS = ("PRPV", "floor", "excess", "PPV")


@dataclass(frozen=True)
class Split:
    """What a study would say, and what is so."""

    said: Expectation  # the expectation
    # whether (of the floor: in what share of next tables) each claim's interval holds, in the order of CLAIMS
    holds: tuple[float, ...]
    excess: float  # how much more PRPV is expected of the proxy than of the target itself


def drawn(tables: Floats, rng: np.random.Generator, count: int = 1) -> Floats:
    """So many tables (count, agents, starts, metrics), each cell by itself from its repeats."""
    chosen = rng.integers(len(tables), size=(count, *tables.shape[1:3]))
    agents, starts = np.indices(tables.shape[1:3])
    return np.asarray(tables[chosen, agents, starts])


def table_of(values: Floats, metrics: list[Metric]) -> ScoreTable:
    """Repeats (n, agents, starts, metrics) as one table, episodes START/REPEAT where there are several."""
    n, _, starts, _ = values.shape
    labels = [f"{start}/{repeat}" if n > 1 else str(start) for start in range(starts) for repeat in range(n)]
    rows = values.transpose(1, 2, 0, 3).reshape(values.shape[1], starts * n, -1)
    names = tuple(f"A{row:02}" for row in range(len(rows)))
    return ScoreTable(names, tuple(labels), tuple(metric.name for metric in metrics), rows)


def split(kept: dict[str, Floats], target: int, kind: str, starts: int, times: int, seed: int) -> Split:
    """Draw one study of a target and a proxy, the target measured so many times."""
    metrics = [Metric("distance", "max"), Metric("survival_time", "max")]
    rng = np.random.default_rng((seed, target, KINDS.index(kind), starts))
    chosen = rng.permutation(STARTS)[:starts]
    itself, proxy, rival = (kept[f"{target} {one}"][:, :, chosen] for one in ("itself", kind, RIVALS[kind]))
    measured = drawn(itself, rng, times)
    pairs = [drawn(each, rng, 2) for each in (proxy, rival)]
    on_target, fresh = table_of(measured, metrics), drawn(proxy, rng, REPETITIONS)
    donors = donors_of([*pairs, kept["centre"][:, :, chosen[:PLACES]]], len(metrics))
    tables = [table_of(one[None], metrics) for one in fresh]
    said = expect(fresh=tables, target=on_target, metrics=metrics, donors=donors, seed=seed)
    means, beta = on_target.means, 1.0 / on_target.means.std(axis=0, ddof=1)
    following, perfect = (drawn(each, rng, NEXT).mean(axis=2) for each in (proxy, itself))
    scores, levels = (prpv_of_means(each, np.broadcast_to(means, each.shape), metrics) for each in (following, perfect))
    assert said.prpv.floor is not None
    assert said.prpv.excess is not None
    assert said.ppv is not None
    more = float(scores.mean() - levels.mean())

    def inside(ends: tuple[float, float | None, float | None], value: Floats | float) -> float:
        return float(np.mean((value >= np.array(ends[1])) & (value <= np.array(ends[2]))))

    holds = (
        inside(said.prpv.value, float(scores.mean())),
        inside(said.prpv.floor, levels),
        inside(said.prpv.excess, more),
        inside(said.ppv.value, float(ppv_of_means(following, means, beta).mean())),
    )
    return Split(said, holds, more)


def rows(kept: dict[str, Floats], starts: list[int], splits: int, times: int) -> Iterator[str]:
    """A row of the table for every number of starts and kind of proxy, and one for all."""
    every: list[Split] = []
    targets = sorted({int(name[0]) for name in kept if name != "centre"})
    for count in starts:
        for kind in KINDS:
            found = [split(kept, targets[n % len(targets)], kind, count, times, n) for n in range(splits)]
            every += found
            yield row(f"{count} | {kind}", found)
    yield row("all | all", every)


def row(name: str, found: list[Split]) -> str:
    """Coverage and mean width of every claim, and how often a perfect proxy is said to score lower, by what is so."""
    cells = []
    for place, claim in enumerate(CLAIMS):
        ends = [(one.said.ppv or one.said.prpv).value if claim == "PPV" else _ends(one, claim) for one in found]
        width = np.mean([high - low for _, low, high in ends])
        cells.append(f"{np.mean([one.holds[place] for one in found]):.3f} ({width:.2g})")
    said = [_ends(one, "excess")[1] > 0.0 for one in found]
    no, yes = ([flag for flag, one in zip(said, found, strict=True) if one.excess > limit] for limit in (-1e9, 4.0))
    wrongly = [flag for flag, one in zip(said, found, strict=True) if one.excess <= 0.5]
    shares = [f"{sum(some)} of {len(some)}" for some in (wrongly, yes)]
    return f"| {name} | {len(no)} | {' | '.join([*cells, *shares])} |"


def _ends(one: Split, claim: str) -> tuple[float, float, float]:
    prpv, ppv = one.said.prpv, one.said.ppv
    known = {"PRPV": prpv.value, "floor": prpv.floor, "excess": prpv.excess, "PPV": ppv and ppv.value}[claim]
    assert known is not None
    value, low, high = known
    return value, low or 0.0, high or 0.0


def main() -> None:
    """Print the table, for a target measured once and twice."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tables", type=Path)
    parser.add_argument("--splits", type=int, default=500)
    parser.add_argument("--starts", default="4,6,10")
    parser.add_argument("--plant", choices=("planar", "bullet"), default="planar", help="whose episodes TABLES holds")
    parser.add_argument("--times", type=int, default=1, help="how often the target was measured")
    options = parser.parse_args()
    drive_tables(options.tables, options.plant)
    kept = read_tables(options.tables)
    print("| starts | proxy | splits | PRPV | floor | excess | PPV | wrongly called imperfect | rightly |")
    print("|---|---|---|---|---|---|---|---|---|")
    for line in rows(kept, [int(part) for part in options.starts.split(",")], options.splits, options.times):
        print(line, flush=True)


if __name__ == "__main__":
    main()
