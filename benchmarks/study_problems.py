"""Studies as problems that search engines are compared on, with the target that they have or one of each seed's own."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from proxytune.domain import DomainFamily
from proxytune.errors import EpisodeError
from proxytune.scores import ScoreTable
from proxytune.search import Goal, Values, from_unit, to_unit
from proxytune.seeds import fresh_seed, target_seed
from proxytune.space import Space
from proxytune.study import (
    Evaluation,
    Study,
    StudyRun,
    failure_of,
    goal_of,
    load_family,
    outputs_of,
    plan_episodes,
    run_preflight,
    score_table,
    study_facts,
)
from proxytune.usefulness import assess


@dataclass(frozen=True)
class StudyObjective:
    """PRPV of a study.

    Regret is PRPV above the target's noise floor: the optimum is not known.
    """

    run: StudyRun  # the study, whose episodes are simulated when first asked for
    floor: float  # the target's noise floor, 0 where its episodes do not tell
    tolerance: float = 0.0  # a regret not above this cannot be told from none
    # the same study by seed, as they were first asked for
    runs: dict[int, StudyRun] = field(default_factory=dict, compare=False, repr=False)

    @property
    def name(self) -> str:
        """The study's name."""
        return self.run.settings.name

    @property
    def space(self) -> Space:
        """The study's box."""
        return self.run.settings.space

    @property
    def seconds(self) -> float | None:
        """Simulated seconds of an evaluation, were every episode to last as long as it may; None where none is said."""
        longest = getattr(self.run.study.family, "seconds", None)
        return None if longest is None else longest * len(self.run.settings.agents) * self.run.settings.starts

    @property
    def identity(self) -> str:
        """All that its figures depend on, apart from the seed."""
        return self.identity_without(())

    def identity_without(self, named: Sequence[str]) -> str:
        """The same, but for some of the study's facts."""
        left_out = {"seed", "initial", "batch", "engine", "cut_off", *named}
        return repr(sorted((key, value) for key, value in study_facts(self.run.study).items() if key not in left_out))

    def score(self, values: Values, seed: int) -> float | None:
        """What the study makes small, with the placement noise of this seed; None where an agent has no score."""
        return self._evaluate(values, seed).score

    def failure(self, values: Values, seed: int) -> str:
        """Which agent failed, and why; empty where there is a score."""
        return self._evaluate(values, seed).failure

    def outcome(self, values: Values, seed: int) -> Values | None:
        """Every agent's mean metrics; None where an agent has no episode that worked."""
        run, theta = self._seeded(seed), self.space.theta(values)
        run.evaluate(theta, f"seed {seed}")
        return outputs_of(run.study, run.known(plan_episodes(run.settings, theta, seed)).values())

    def goal(self, seed: int) -> Goal:
        """The target's mean metrics, noise by this seed's pre-flight, and what the study makes small."""
        run_preflight(self._seeded(seed))
        return goal_of(self._seeded(seed))

    def regret(self, values: Values, seed: int, lowest: float = math.inf) -> float | None:
        """The score above the noise floor."""
        return self._above(self.score(values, seed))

    def fresh_score(self, values: Values, seed: int) -> float | None:
        """PRPV of episodes that no engine has seen."""
        return self.score(values, fresh_seed(seed, 1))

    def fresh_regret(self, values: Values, seed: int) -> float | None:
        """PRPV of fresh episodes above the noise floor."""
        return self._above(self.fresh_score(values, seed))

    def truth(self, seed: int) -> None:
        """Not known: a study's target is what was measured."""

    def error(self, values: Values, seed: int) -> None:
        """Not known: a study's target is what was measured."""

    def _evaluate(self, values: Values, seed: int) -> Evaluation:
        return self._seeded(seed).evaluate(self.space.theta(values), f"seed {seed}")

    def _above(self, score: float | None) -> float | None:
        return None if score is None else score - self.floor

    def _seeded(self, seed: int) -> StudyRun:
        if seed not in self.runs:
            study = self.run.study
            self.runs[seed] = self.run.of(replace(study, settings=replace(study.settings, seed=seed)))
        return self.runs[seed]


def noise_floor(study: Study) -> float:
    """PRPV of the target against itself by halves of its episodes; 0 where there are too few."""
    found = assess(proxy=study.target, target=study.target, metrics=study.settings.metrics)
    return found.noise_floor.value or 0.0


MIDDLE = (0.1, 0.9)
"""Truths are drawn from this part of every parameter's interval."""


@dataclass(frozen=True)
class TruthObjective:
    """PRPV of a study whose target is simulated: in the domain instance θ* of the seed, under other placement noise.

    Regret is PRPV above the truth's own: that of θ* in the proxy, the mean of the seed's and of fresh episodes. A
    visited point that seems no worse is driven again in fresh episodes, so that it has to be lucky twice.
    """

    run: StudyRun  # the study; its own target is not looked at
    # what targets are measured in, one after the other by seed, if not in the proxy itself: families that have
    # effects which the proxy lacks
    lacking: tuple[DomainFamily, ...] = ()
    tolerance: float = 0.0  # a regret not above this cannot be told from none
    # the study against each seed's target, as they were first asked for
    objectives: dict[int, StudyObjective] = field(default_factory=dict, compare=False, repr=False)

    @property
    def name(self) -> str:
        """The study's name."""
        return self.run.settings.name

    @property
    def space(self) -> Space:
        """The study's box."""
        return self.run.settings.space

    @property
    def seconds(self) -> float | None:
        """Simulated seconds of an evaluation; None where none is said."""
        return StudyObjective(self.run, 0.0).seconds

    @property
    def identity(self) -> str:
        """All that its figures depend on, apart from the seed."""
        proxy = StudyObjective(self.run, 0.0).identity_without(("target",))
        return f"truths {MIDDLE} {proxy} {[family.identity for family in self.lacking]}"

    def truth(self, seed: int) -> Values:
        """The θ* that made the seed's target."""
        return from_unit(self.space, np.random.default_rng([seed, 1]).uniform(*MIDDLE, len(self.space.intervals)))

    def score(self, values: Values, seed: int) -> float | None:
        """PRPV, with the placement noise of this seed; None where an agent has no episode that worked."""
        return self._of(seed).score(values, seed)

    def failure(self, values: Values, seed: int) -> str:
        """Which agent failed, and why; empty where there is a score."""
        return self._of(seed).failure(values, seed)

    def fresh_score(self, values: Values, seed: int) -> float | None:
        """PRPV of episodes that no engine has seen."""
        return self._of(seed).fresh_score(values, seed)

    def outcome(self, values: Values, seed: int) -> Values | None:
        """Every agent's mean metrics; None where an agent has no episode that worked."""
        return self._of(seed).outcome(values, seed)

    def goal(self, seed: int) -> Goal:
        """The target's mean metrics, noise by this seed's pre-flight, and PRPV."""
        return self._of(seed).goal(seed)

    def regret(self, values: Values, seed: int, lowest: float = math.inf) -> float | None:
        """PRPV above the truth's: where its own is not above that, the larger of its own and that of fresh episodes.

        These are left out where its own is no lower than the lowest so far.
        """
        own, level = self.score(values, seed), self._level(seed)
        if own is None or own > level or own - level >= lowest:
            return None if own is None else own - level
        fresh = self.fresh_score(values, seed)
        return None if fresh is None else max(own, fresh) - level

    def fresh_regret(self, values: Values, seed: int) -> float | None:
        """PRPV of fresh episodes above the truth's, of the same fresh placements."""
        found, at_truth = self.fresh_score(values, seed), self.fresh_score(self.truth(seed), seed)
        return None if found is None or at_truth is None else found - at_truth

    def error(self, values: Values, seed: int) -> float:
        """Mean distance of the parameters from the true ones, in widths of the box."""
        return float(np.abs(to_unit(self.space, values) - to_unit(self.space, self.truth(seed))).mean())

    def study(self, seed: int) -> Study:
        """The study of this seed, its target measured at the truth."""
        study = self._of(seed).run.study
        return replace(study, settings=replace(study.settings, seed=seed))

    def _level(self, seed: int) -> float:
        truth = self.truth(seed)
        scores = [found for found in (self.score(truth, seed), self.fresh_score(truth, seed)) if found is not None]
        if len(scores) < 2:
            raise EpisodeError(
                f"seed {seed}: the truth has no score in the proxy: an agent fails there from every start"
            )
        return float(np.mean(scores))

    def _of(self, seed: int) -> StudyObjective:
        """The study against this seed's target, which is measured when first asked for."""
        if seed not in self.objectives:
            study = replace(self.run.study, target=self._target(seed))
            self.objectives[seed] = StudyObjective(self.run.of(study), 0.0)
        return self.objectives[seed]

    def _target(self, seed: int) -> ScoreTable:
        study = self.run.study
        family = self.lacking[seed % len(self.lacking)] if self.lacking else study.family
        place = self.run.of(replace(study, family=family, identity=family.identity))
        planned = plan_episodes(study.settings, self.space.theta(self.truth(seed)), target_seed(seed))
        outcomes = place.outcomes(planned, f"target of seed {seed}")
        for outcome in outcomes.values():
            if outcome.failure:
                raise EpisodeError(f"target of seed {seed}: {failure_of(outcome)}")
        return score_table(list(outcomes.values())).select(
            list(dict.fromkeys([*study.target.metrics, *family.metrics]))
        )


def lacking_families(study: Study, models: Sequence[Path]) -> tuple[DomainFamily, ...]:
    """The study's family with the effects of each model besides its own.

    Raises:
        InputError: If a model cannot be used, or the proxy has a model already.
    """
    if models and study.settings.proxy:
        raise study.settings.error("proxy", "is given, and a target cannot have two models; remove it to use --lacks")
    return tuple(load_family(study.settings, model) for model in models)
