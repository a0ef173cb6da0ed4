"""A study as something that engines are compared on: each seed is a study of its own, simulated once."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from proxytune.running.progress import Watcher
from proxytune.search.goal import Goal
from proxytune.search.proposer import Values
from proxytune.seeds import fresh_seed
from proxytune.space import Space
from proxytune.storage.store import Store
from proxytune.study.evaluation import Evaluation, evaluation, known_outcomes, plan, simulate
from proxytune.study.outputs import goal_of, outputs_of
from proxytune.study.preflight import run_preflight
from proxytune.study.study import Study, facts
from proxytune.usefulness import assess


@dataclass(frozen=True)
class StudyObjective:
    """PRPV of a study; its episodes are simulated when first asked for, and kept in the store.

    Regret is PRPV above the target's noise floor: the optimum is not known.

    Attributes:
        study: The study.
        store: Where its episodes are kept.
        watcher: Is told of every episode.
        floor: The target's noise floor, 0 where its episodes do not tell.
    """

    study: Study
    store: Store
    watcher: Watcher
    floor: float
    tolerance: float = 0.0

    @property
    def name(self) -> str:
        """The study's name."""
        return self.study.settings.name

    @property
    def space(self) -> Space:
        """The study's box."""
        return self.study.settings.space

    @property
    def identity(self) -> str:
        """All that its figures depend on, apart from the seed."""
        return self.identity_without(())

    def identity_without(self, named: Sequence[str]) -> str:
        """The same, but for some of the study's facts."""
        left_out = {"seed", "initial", "batch", "engine", "cut_off", *named}
        return repr(sorted((key, value) for key, value in facts(self.study).items() if key not in left_out))

    def score(self, values: Values, seed: int) -> float | None:
        """PRPV, with the placement noise of this seed; None where an agent has no episode that worked."""
        return self._evaluated(values, seed).prpv

    def outcome(self, values: Values, seed: int) -> Values | None:
        """Every agent's mean metrics; None where an agent has no episode that worked."""
        self._evaluated(values, seed)
        seeded = self._seeded(seed)
        planned = plan(seeded.settings, self.space.theta(values), seed)
        return outputs_of(seeded, known_outcomes(seeded, self.store, planned).values())

    def goal(self, seed: int) -> Goal:
        """The target's mean metrics, noise by this seed's pre-flight, and PRPV."""
        seeded = self._seeded(seed)
        run_preflight(seeded, self.store, self.watcher)
        return goal_of(seeded, self.store)

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

    def _above(self, score: float | None) -> float | None:
        return None if score is None else score - self.floor

    def _seeded(self, seed: int) -> Study:
        return replace(self.study, settings=replace(self.study.settings, seed=seed))

    def _evaluated(self, values: Values, seed: int) -> Evaluation:
        seeded = self._seeded(seed)
        theta = self.space.theta(values)
        found = evaluation(seeded, self.store, theta)
        if found is None:
            simulate(seeded, self.store, theta, self.watcher, f"seed {seed}")
            found = evaluation(seeded, self.store, theta)
        assert found is not None
        return found


def noise_floor(study: Study) -> float:
    """PRPV of the target against itself by halves of its episodes; 0 where there are too few."""
    found = assess(proxy=study.target, target=study.target, metrics=study.settings.metrics)
    return found.noise_floor.value or 0.0
