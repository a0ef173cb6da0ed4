"""How good is the answer that a study gives? `python benchmarks/answers.py OUTPUT [--seeds 101:130] [--budget 24]`.

Every seed draws a θ* from the middle of the box of benchmarks/truths. Its target is driven there under other placement
noise, and a whole study is run against it: search, then confirmation. θ* and the answer are then driven 20 times
afresh by the study's twelve agents, and by five that no study knows. OUTPUT keeps what is finished, so it may be
stopped and run on; with BEFORE, another OUTPUT, differences are told too. Prints tables in Markdown.
"""

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import bootstrap
from study_problems import TruthObjective

from proxytune.arrays import Floats
from proxytune.search import Values, to_unit
from proxytune.seeds import fresh_seed, target_seed
from proxytune.storage import Store
from proxytune.study import StudyRun, open_study, plan_episodes, result_of, run_stages
from proxytune.usefulness import prpv_of_means

STUDY = Path(__file__).resolve().parent / "truths"
HELD_OUT = ("crawler", "pursuer_far", "yellow_only", "sharp_eyed", "edges")
REPEATS, FIRST = 20, 100
"""How often a θ is driven afresh, and the number of the first repetition, which no confirmation comes to."""


def means(run: StudyRun, values: Values, seeds: Sequence[int]) -> Floats:
    """Mean metrics (seeds, agents, metrics) of a θ under seeds, the agents that no study knows last."""
    settings = replace(run.settings, agents=(*run.settings.agents, *HELD_OUT))
    names, theta = [metric.name for metric in settings.metrics], settings.space.theta(values)
    planned = [episode for seed in seeds for episode in plan_episodes(settings, theta, seed)]
    outcomes = run.of(replace(run.study, settings=settings)).outcomes(planned, "afresh")
    cells = [[(outcomes[one].metrics or {}).get(name, np.nan) for name in names] for one in planned]
    return np.nanmean(np.array(cells).reshape(len(seeds), len(settings.agents), settings.starts, -1), axis=2)


def run_seed(objective: TruthObjective, folder: Path, seed: int) -> dict[str, Any]:
    """Run the study of a seed to its end, and drive what it found afresh."""
    study, space, truth = objective.study(seed), objective.space, objective.truth(seed)
    folder.mkdir(exist_ok=True)
    with Store.open(folder) as store:
        run = StudyRun(study, store)
        run_stages(run, lambda _: None)
        result = result_of(run)
    found, posterior = space.values(result.best.trial.theta), result.knowledge.posterior
    count, metrics = len(study.settings.agents), study.settings.metrics
    target = means(objective.run, truth, [target_seed(seed)])[0]
    fresh = [fresh_seed(seed, FIRST + repeat) for repeat in range(REPEATS)]

    def scores(values: Values) -> dict[str, list[float]]:
        """PRPV of every repetition, by those who drove."""
        driven = means(objective.run, values, fresh)
        parts = {"known": slice(count), "held out": slice(count, None)}
        return {name: prpv_of_means(driven[:, part], target[part], metrics).tolist() for name, part in parts.items()}

    units = {"truth": to_unit(space, truth), "answer": to_unit(space, found)}
    units |= {"mode": posterior.mode, "mean": posterior.mean}
    return {
        "seed": seed,
        "points": {name: unit.tolist() for name, unit in units.items()},
        "scores": {"truth": scores(truth), "answer": scores(found)},
        "expected": list(result.expected.prpv.value) if result.expected else None,
        "visited": result.best.trial.number > 0,
        "holds": result.knowledge.holds(truth),
        "share": posterior.share,
    }


def read(output: Path) -> dict[int, dict[str, Any]]:
    """What is finished, by seed."""
    path = output / "answers.jsonl"
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {row["seed"]: row for row in map(json.loads, lines)}


def told(rows: Sequence[dict[str, Any]], names: Sequence[str]) -> Iterator[str]:
    """What is finished, in Markdown: means and medians with 95 % bootstrap intervals over truths."""
    truth, answer = (scores_of(rows, name) for name in ("truth", "answer"))
    yield "| PRPV, 20 times afresh | θ* | the answer | its share of θ*'s |"
    yield "|---|---|---|---|"
    for part, agents in enumerate(("the study's agents", "agents held out")):
        one, own = answer[:, part], truth[:, part]
        yield f"| {agents} | {between(np.mean, own)} | {between(np.mean, one)} | {between(ratio, one, own)} |"
    yield ""
    yield f"| θ error, median | all | {' | '.join(names)} |"
    yield f"|---|---|{'---|' * len(names)}"
    for point in ("answer", "mode", "mean"):
        errors = errors_of(rows, point)
        each = " | ".join(f"{np.median(column):.3f}" for column in errors.T)
        yield f"| {point} | {between(np.median, errors.mean(axis=1))} | {each} |"
    yield ""
    known = [(row["expected"], mean) for row, mean in zip(rows, answer[:, 0], strict=True) if row["expected"]]
    yield (
        f"Of {len(rows)} truths the 95 % region holds {sum(row['holds'] for row in rows)}, with a median share of "
        f"{100 * np.median([row['share'] for row in rows]):.1f} % of the box; the interval of expected PRPV holds the "
        f"mean of the repetitions in {sum(low <= mean <= high for (_, low, high), mean in known)} of {len(known)}; no "
        f"trial visited the answer in {sum(not row['visited'] for row in rows)}."
    )


def compared(rows: Sequence[dict[str, Any]], before: Sequence[dict[str, Any]]) -> str:
    """What is other of the answers than before, in one line."""
    now, then = (scores_of(some, "answer") for some in (rows, before))
    away, was = (errors_of(some, "answer").mean(axis=1) for some in (rows, before))
    less = zip(("PRPV", "that of agents held out", "θ error"), [*(now - then).T, away - was], strict=True)
    return "Less before, means: " + "; ".join(f"{name} {between(np.mean, values)}" for name, values in less) + "."


def scores_of(rows: Sequence[dict[str, Any]], name: str) -> Floats:
    """Mean PRPV of all repetitions (truths, 2), by the study's agents and by those held out."""
    return np.array([[np.mean(row["scores"][name][part]) for part in ("known", "held out")] for row in rows])


def errors_of(rows: Sequence[dict[str, Any]], name: str) -> Floats:
    """Distances from θ* (truths, parameters), in widths of the box."""
    return np.abs([np.subtract(row["points"][name], row["points"]["truth"]) for row in rows])


def ratio(one: Floats, other: Floats, axis: int = -1) -> Floats:
    """Of two means."""
    return np.asarray(np.mean(one, axis=axis) / np.mean(other, axis=axis))


def between(statistic: Callable[..., Any], *values: Floats) -> str:
    """A statistic of truths, paired if of several, with its 95 % interval; one truth has none."""
    if len(values[0]) < 2:
        return f"{statistic(*values):.3g}"
    found = bootstrap(values, statistic, paired=True, n_resamples=4000, method="percentile", rng=0)
    low, high = found.confidence_interval
    return f"{statistic(*values):.3g} ({low:.2g} to {high:.2g})"


def main() -> None:
    """Run what is missing, and print what is known."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("output", type=Path)
    parser.add_argument("--seeds", default="101:130", help="the first and the last")
    parser.add_argument("--plant", choices=("planar", "bullet"), default="planar")
    parser.add_argument("--budget", type=int, default=24, help="trials of each search")
    parser.add_argument("--initial", type=int, help="trials of the design: 8, or 4 beside --low-fidelity, if not said")
    parser.add_argument("--learn-from", type=Path, nargs="*", default=[], help="banks of the same proxy")
    parser.add_argument("--low-fidelity", type=Path, nargs="*", default=[], help="banks of a cheaper proxy")
    parser.add_argument("--before", type=Path, help="another OUTPUT, of the same seeds, to be compared with")
    given = parser.parse_args()
    study = open_study(STUDY)
    family = replace(study.family, plant=given.plant)  # type: ignore[type-var]
    # As a user gets it: trials are cut off that cannot be among the best.
    banks = {key: tuple(str(path.resolve()) for path in getattr(given, key)) for key in ("learn_from", "low_fidelity")}
    counts = {"budget": given.budget, "initial": given.initial or (4 if given.low_fidelity else 8)}
    settings = replace(study.settings, jobs=1, cut_off=True, **counts, **banks)
    study = replace(study, family=family, identity=family.identity, settings=settings)
    first, last = map(int, given.seeds.split(":"))
    seeds = range(first, last + 1)
    (given.output / "driven").mkdir(parents=True, exist_ok=True)
    with Store.open(given.output / "driven") as store:
        objective = TruthObjective(StudyRun(study, store))
        finished = read(given.output)
        for seed in (one for one in seeds if one not in finished):
            row = run_seed(objective, given.output / str(seed), seed)
            with (given.output / "answers.jsonl").open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
    known = read(given.output)
    rows = [known[seed] for seed in seeds]
    print("\n".join(told(rows, study.settings.space.names)))
    if given.before:
        print("\n" + compared(rows, [read(given.before)[seed] for seed in seeds]))


if __name__ == "__main__":
    main()
