"""Is it said that no θ fits, and what becomes of the region then? `python benchmarks/misfit_rates.py OUTPUT`.

Targets are driven on the planar plant at θ* drawn from the middle of the box: with nothing that the proxy lacks, and
with each of six effects in two sizes. The trials of the shipped bank alone tell θ, so a target costs its own episodes
and no trial. Whether an effect counts is asked of PRPV at θ*: the proxy's, on fresh episodes, against that of a perfect
proxy (the same effect, fresh episodes), beyond noise. Rules were chosen on the part `tune`; `count` has other θ* and
seeds. OUTPUT keeps the episodes' metrics, so it may be stopped and run on. Prints tables in Markdown.
"""

import argparse
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from proxytune.arrays import Floats
from proxytune.domain import DomainFamily
from proxytune.files import shipped
from proxytune.running import run_together
from proxytune.search import Goal, Trial, Values, from_unit, to_unit
from proxytune.search.likelihood import Likelihood, fit_outputs
from proxytune.search.posterior import Posterior, leave_out, misfit_of, posterior_of
from proxytune.seeds import fresh_seed, target_seed
from proxytune.storage import Store
from proxytune.study import (
    Study,
    StudyRun,
    earlier_trials,
    goal_of,
    learn,
    load_family,
    open_bank,
    plan_episodes,
    read_study_settings,
    run_preflight,
)
from proxytune.usefulness import prpv_of_means

BANK = "duckiebot_bank"
MIDDLE = (0.1, 0.9)
PARTS = {"tune": 1, "count": 2}
NOTHING, LACKING = 40, 4
"""Truths with nothing missing, and the first so many of these with each effect."""
EFFECTS: Mapping[str, Mapping[str, Mapping[str, float]]] = {
    "driver_map": {"large": {"offset": 0.12}},
    "wheel_gain": {"large": {"left": 0.85, "right": 0.9}},
    "yaw_scrub": {"large": {"baseline": 0.22}},
    "camera_height": {"large": {"camera_height": 0.13}, "twice": {"camera_height": 0.152}},
    "motor_lag": {"large": {"time_constant": 0.4}, "twice": {"time_constant": 0.6}},
    "dead_band": {"large": {"width": 0.15}},
}
"""Each effect's parameters: as in benchmarks/truths; of two that another θ makes up for also twice as far off."""
POINTS = 2048
"""So many points tell a region."""
FEW, TOGETHER = 24, 10
"""The first trials of the bank that tell alone, and how many targets are driven side by side."""


@dataclass(frozen=True)
class Place:
    """Where targets are driven."""

    study: Study  # the bank
    output: Path  # the folder that keeps what was driven
    part: str  # which part of the truths

    def truth(self, number: int) -> Values:
        """The θ* of a number."""
        space = self.study.settings.space
        rng = np.random.default_rng([PARTS[self.part], number])
        return from_unit(space, rng.uniform(*MIDDLE, len(space.names)))

    def drive(self, kind: str, size: str, wanted: Sequence[tuple[int, int]]) -> None:
        """Drive every agent from every start, for pairs of a truth and a repetition: 0 the target, else fresh ones."""
        missing = [one for one in wanted if not self._path(kind, size, *one).exists()]
        if not missing:
            return
        settings = self.study.settings
        planned = []
        for number, repetition in missing:
            seed = fresh_seed(target_seed(1000 * PARTS[self.part] + number), repetition)
            planned += plan_episodes(settings, settings.space.theta(self.truth(number)), seed)
        outcomes = run_together(self._family(kind, size), planned) or ()
        names = self.study.target.metrics
        cells = np.array([[(one.metrics or {}).get(name, np.nan) for name in names] for one in outcomes])
        found = cells.reshape(len(missing), len(settings.agents), settings.starts, len(names))
        for one, table in zip(missing, found, strict=True):
            np.save(self._path(kind, size, *one), table)

    def table(self, kind: str, size: str, number: int, repetition: int) -> Floats:
        """The metrics that were driven, (agents, starts, metrics)."""
        return np.asarray(np.load(self._path(kind, size, number, repetition)))

    def _path(self, kind: str, size: str, number: int, repetition: int) -> Path:
        return self.output / f"{self.part}-{number}-{kind or 'nothing'}-{size or 'none'}-{repetition}.npy"

    def _family(self, kind: str, size: str) -> DomainFamily:
        if not kind:
            return self.study.family
        lines = ["format = 1", 'robot = "duckiebot"', f"[effects.{kind}]"]
        lines += [f"{name} = {value}" for name, value in EFFECTS[kind][size].items()]
        with tempfile.TemporaryDirectory() as folder:
            model = Path(folder) / "lacks.toml"
            model.write_text("\n".join(lines) + "\n", encoding="utf-8")
            return load_family(self.study.settings, model)


@dataclass(frozen=True)
class Told:
    """What trials say of one target."""

    effect: tuple[str, str]  # what it has and the proxy lacks, and its size; empty for nothing
    p_value: float  # of the misfit
    fits: bool  # whether some θ may explain the target
    held: bool  # whether the 95 % region holds θ*
    share: float  # the region's share of the box
    narrow: bool  # whether it would hold θ* if a misfit did not make it wider


def changes(place: Place) -> dict[tuple[str, str, int], tuple[float, float]]:
    """PRPV at θ* of the proxy, the mean of two repetitions, and of a perfect proxy, by effect, size and truth."""
    metrics, names = place.study.settings.metrics, place.study.target.metrics
    compared = [names.index(metric.name) for metric in metrics]

    def means(kind: str, size: str, number: int, repetition: int) -> Floats:
        return np.asarray(place.table(kind, size, number, repetition).mean(axis=1)[:, compared])

    found = {}
    for kind, size, number in lacking():
        target = means(kind, size, number, 0)
        scores = [float(prpv_of_means(means("", "", number, r), target, metrics)) for r in (0, 1)]
        perfect = float(prpv_of_means(means(kind, size, number, 1), target, metrics))
        found[kind, size, number] = (float(np.mean(scores)), perfect)
    return found


def lacking() -> list[tuple[str, str, int]]:
    """The targets that have an effect: its name, its size, the truth's number."""
    return [(kind, size, n) for kind, sizes in EFFECTS.items() for size in sizes for n in range(LACKING)]


def tell(place: Place, trials: Sequence[Trial], goal: Goal, targets: Sequence[tuple[str, str, int]]) -> Iterator[Told]:
    """Ask what trials know of θ once each target is known, as `Knowledge` does with more points."""
    space = place.study.settings.space
    model = fit_outputs(space, trials)
    # Of a target these have its noise alone, so all have them in common.
    left_out = leave_out(model, trials, goal, 1)
    for kind, size, number in targets:
        target = place.table(kind, size, number, 0).mean(axis=1).ravel()
        likelihood = Likelihood(model, replace(goal, values=target))

        def region(dispersion: float, likelihood: Likelihood = likelihood) -> Posterior:
            wider = left_out.widening * dispersion
            return posterior_of(lambda points: likelihood.log(points) / wider, len(space.names), POINTS)

        own, narrow = likelihood.log(to_unit(space, place.truth(number))[None])[0] / left_out.widening, region(1.0)
        misfit = misfit_of(likelihood, narrow, left_out)
        wide = region(misfit.dispersion)
        held = bool(own / misfit.dispersion >= wide.threshold)
        inside = bool(own >= narrow.threshold)
        yield Told((kind, size), misfit.p_value or 0.0, misfit.fits is not False, held, wide.share, inside)


def rows(told: Sequence[Told], changed: Mapping[tuple[str, str, int], tuple[float, float]]) -> Iterator[str]:
    """A row per effect and size, of the targets where it changes PRPV at θ* beyond noise, and one for nothing."""
    noise = float(np.std([perfect for _, perfect in changed.values()], ddof=1)) * np.sqrt(1.5)
    for kind, size in dict.fromkeys(one.effect for one in told):
        some = [one for one in told if one.effect == (kind, size)]
        pairs = [pair for (k, s, _), pair in changed.items() if (k, s) == (kind, size)]
        prpv, counted = "", some
        if pairs:
            before, perfect = np.mean(pairs, axis=0)
            prpv = f"{before:.0f}, {perfect:.0f}"
            beyond = [proxy - best > 1.96 * noise for proxy, best in pairs]
            counted = [one for one, flag in zip(some, beyond, strict=True) if flag]
        said = [one for one in counted if not one.fits]
        cells = [
            f"{kind or 'nothing'} {size}".strip(),
            prpv,
            f"{len(said)} of {len(counted)}",
            ", ".join(f"{one.p_value:.3f}" for one in counted) if kind else "",
            f"{sum(one.narrow for one in said)}, {sum(one.held for one in said)} of {len(said)}",
            f"{sum(one.held for one in counted if one.fits)} of {len(counted) - len(said)}",
            f"{np.median([one.share for one in counted]):.1%}" if counted else "",
        ]
        yield f"| {' | '.join(cells)} |"


def main() -> None:
    """Drive what is left, and print a table for all trials of the bank and one for the first of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("output", type=Path)
    parser.add_argument("--part", choices=tuple(PARTS), default="count")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    study = open_bank(read_study_settings(shipped("studies") / BANK))
    place = Place(study, options.output, options.part)
    for kind, sizes in EFFECTS.items():
        for size in sizes:
            place.drive(kind, size, [(n, r) for n in range(LACKING) for r in (0, 1)])
    place.drive("", "", [(n, 1) for n in range(LACKING)])
    for first in range(0, NOTHING, TOGETHER):
        place.drive("", "", [(n, 0) for n in range(first, first + TOGETHER)])
    with tempfile.TemporaryDirectory() as folder, Store.open(Path(folder)) as store:
        settings = replace(study.settings, path=Path(folder) / "study.toml", learn_from=(BANK,))
        run = StudyRun(replace(study, settings=settings), store)
        run_preflight(run)
        learn(run)
        trials, goal = earlier_trials(run), goal_of(run)
    changed, targets = changes(place), [*lacking(), *(("", "", n) for n in range(NOTHING))]
    for some in (trials, trials[:FEW]):
        print(f"\n{len(some)} trials, part {options.part}\n")
        print(
            "| lacking | PRPV at θ*: proxy, perfect | misfit said | p "
            "| region holds θ* where said: not widened, widened | where not said | its share |"
        )
        print("|---|---|---|---|---|---|---|")
        for line in rows(list(tell(place, some, goal, targets)), changed):
            print(line, flush=True)


if __name__ == "__main__":
    main()
