"""A study as something that engines are compared on: each seed is a study of its own, simulated once."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from proxytune.search import Goal, Values
from proxytune.seeds import fresh_seed
from proxytune.space import Space
from proxytune.study import Evaluation, Study, StudyRun, goal_of, outputs_of, plan, run_preflight, study_facts
from proxytune.usefulness import assess


@dataclass(frozen=True)
class StudyObjective:
    """PRPV of a study.

    Regret is PRPV above the target's noise floor: the optimum is not known.

    Attributes:
        run: The study, whose episodes are simulated when first asked for.
        floor: The target's noise floor, 0 where its episodes do not tell.
        tolerance: A regret not above this cannot be told from none.
        runs: The same study by seed, as they were first asked for.
    """

    run: StudyRun
    floor: float
    tolerance: float = 0.0
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
        return outputs_of(run.study, run.known(plan(run.settings, theta, seed)).values())

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
