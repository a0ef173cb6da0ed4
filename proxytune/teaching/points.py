"""The pieces of a learning experiment, each cached by all that determines it: samples, weights, scores.

A `CurvePoint` is one point of a learning curve; `TeachingSetup` scores it. Its learner goes through one or two stages
(`Stage`): the lessons of a proxy, if one teaches, and those of the target; each has samples and the weights they lead
to. Trainings, lessons and examinations run code that is not ours: what it raises is named, and what hangs is ended
(`Supervised`). `search_space` is the box that is searched for learning value: centre and width of each parameter's
distribution p(θ).
"""

import functools
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from proxytune import learning
from proxytune.arrays import one_thread
from proxytune.domain import Classroom, Demonstration, Episode, OnPolicyClassroom, Policy, make_episode
from proxytune.errors import EpisodeError, LearnerError, ProxytuneError
from proxytune.extensions import Heeding, describe, is_users, place_of
from proxytune.running import check_machine, limited, was_ended_in
from proxytune.seeds import exam_seed, proxy_lessons_seed, round_seed, target_lessons_seed
from proxytune.space import Interval, Space, Theta

if TYPE_CHECKING:  # a process that scores points starts without it
    from proxytune.study import StudySettings

TOGETHER = " and the others beside it"
"""Ends the name of what several episodes do at once: which of them fails is not known then."""
DRIVING = {
    "demonstrate": "the expert's lesson",
    "guide": "the learner's lesson",
    "examine": "the learner's examination",
}
"""What a classroom's methods do whose first argument is an episode."""


@contextmanager
def watching(what: str, timeout_s: float | None = None) -> Iterator[None]:
    """Raise in one line what code that is not ours raises meanwhile, and end what takes longer than it may.

    It may take `timeout_s` [s], where processes may be ended (`limited`).
    """
    try:
        with Heeding(), limited(what, timeout_s):
            yield
    except BaseException as problem:
        if is_users(problem):
            raise
        check_machine(what, problem, "with more room")
        if isinstance(problem, ProxytuneError):
            raise
        raise EpisodeError(f"{what} raised {describe(problem)}{place_of(problem)}; correct it") from problem


@dataclass(frozen=True)
class Supervised:
    """A classroom of which each lesson and examination is named where it fails, and ended where it takes too long."""

    room: Any
    domain: str  # "proxy" or "target"
    timeout_s: float | None  # how long an episode may take [s], if limited

    def __getattr__(self, member: str) -> Any:
        """A member of the classroom; one that drives an episode is named, and ended."""
        if member.startswith("__") or member == "room":
            raise AttributeError(member)
        found = getattr(self.room, member)
        if member not in DRIVING:
            return found

        def drive(episode: Episode, *rest: Any) -> Any:
            with watching(self._named(DRIVING[member], episode), self.timeout_s):
                return found(episode, *rest)

        return drive

    def examine_together(self, episodes: Sequence[Episode], policy: Policy) -> Sequence[float]:
        """As the classroom does, in so many times as long; where that ended a process, one after the other."""
        together = getattr(self.room, "examine_together", None)
        what = self._named(DRIVING["examine"], episodes[0]) + TOGETHER
        if together is None or was_ended_in(what):
            return [self.examine(episode, policy) for episode in episodes]
        with watching(what, self.timeout_s and self.timeout_s * len(episodes)):
            return together(episodes, policy)  # type: ignore[no-any-return]

    def _named(self, what: str, episode: Episode) -> str:
        theta = "".join(f"{name} = {value:.3g}, " for name, value in episode.theta)
        return f"{what} in the {self.domain} at {theta}start {episode.start}"


@dataclass(frozen=True)
class Lessons:
    """The lessons in a domain, in rounds: one where the expert drives, several where the learner does.

    A learner drives in each round as it has learnt to in those before; as long as there is nothing, the expert does.
    """

    room: Classroom
    domain: str  # its identity
    where: learning.Distribution  # p(θ), of which each lesson has a θ of its own
    seed: int
    lesson_s: float  # how long a lesson takes [s]
    grid: tuple[int, ...]  # number of samples after each round
    on_policy: bool  # whether the learner drives

    @property
    def ends(self) -> tuple[int, ...]:
        """Number of samples after each round."""
        return self.grid if self.on_policy else self.grid[-1:]

    def begin(self, number: int) -> int:
        """Number of samples before a round, counted from 0."""
        return self.ends[number - 1] if number else 0

    def rounds(self, count: int) -> range:
        """The rounds that the first samples, so many, come from."""
        return range(sum(self.begin(number) < count for number in range(len(self.ends))))

    def facts(self, number: int) -> dict[str, Any]:
        """All that determines a round's samples, but for who drives."""
        return {
            "domain": self.domain,
            "theta": {name: list(pair) for name, pair in self.where.bounds.items()},
            "count": self.ends[number] - self.begin(number),
            "seed": round_seed(self.seed, number),
            "lesson_s": self.lesson_s,
        }


@dataclass(frozen=True)
class Stage:
    """A stage of learning: what a learner learns in one domain, after what it has learnt in another.

    Facts of what comes before enter those of what comes after as their digest: each key is short and complete.
    """

    setup: "TeachingSetup"
    seed: int  # of the learner's weights and of its samples' order
    lessons: Lessons
    before: "Stage | None" = None  # without one it begins from scratch

    def weights_facts(self, count: int) -> dict[str, Any] | None:
        """All that determines the weights after so many samples; None where nothing has been learnt."""
        start = self.before.weights_facts(self.before.lessons.ends[-1]) if self.before else None
        if not count:
            return start
        return {
            "learner": self.setup.learner_identity,
            "seed": self.seed,
            "start": learning.facts_digest(start) if start else None,
            "samples": learning.facts_digest(self.round_facts(self.lessons.rounds(count)[-1])),
            "count": count,
            **({"rehearsal": self.setup.settings.rehearsal} if self.before and self.setup.settings.rehearsal else {}),
        }

    def weights(self, count: int) -> learning.Weights | None:
        """The weights after so many samples; None where nothing has been learnt."""
        if not count:
            return self.before.weights(self.before.lessons.ends[-1]) if self.before else None
        facts = self.weights_facts(count)
        assert facts is not None
        return self.setup.cache.get("weights", facts, lambda: self._train(count))

    def samples(self, count: int) -> Demonstration:
        """The first samples, so many; more of them begin with the same ones."""
        rounds = [self.collect(number) for number in self.lessons.rounds(count)]
        observations = np.concatenate([one.observations for one in rounds])[:count]
        return Demonstration(observations, np.concatenate([one.commands for one in rounds])[:count])

    def round_facts(self, number: int) -> dict[str, Any]:
        """All that determines a round's samples: the policy that drives stands for the rounds before."""
        policy = self.weights_facts(self.lessons.begin(number)) if self.lessons.on_policy else None
        return {**self.lessons.facts(number), **({"policy": learning.facts_digest(policy)} if policy else {})}

    def collect(self, number: int) -> Demonstration:
        """The samples of a round."""

        def make() -> learning.Arrays:
            weights = self.weights(self.lessons.begin(number)) if self.lessons.on_policy else None
            policy = None if weights is None else learning.policy_of(self.setup.learner, weights)
            given = self.lessons
            asked = {name: given.facts(number)[name] for name in ("count", "seed", "lesson_s")}
            with watching("a lesson"):
                return learning.collect_samples(given.room, given.where, policy=policy, **asked)._asdict()

        return Demonstration(**self.setup.cache.get("samples", self.round_facts(number), make))

    def _train(self, count: int) -> learning.Weights:
        samples, share = self.samples(count), self.setup.settings.rehearsal
        if self.before and share:
            samples = learning.mix_samples(samples, self.before.samples(self.before.lessons.ends[-1]), share)
        start = self.weights(0)
        with watching("the learner's training"):
            weights: Any = self.setup.learner.train(samples, start, self.seed)
            learner = self.setup.settings.learner
            if not isinstance(weights, Mapping) or not all(
                isinstance(name, str) and not np.asarray(array).dtype.hasobject for name, array in weights.items()
            ):
                raise LearnerError(f"train of '{learner}' returned no arrays of numbers by name; return a dict of such")
            if taken := next((name for name in learning.NOT_KEPT if name in weights), ""):
                raise LearnerError(f"train of '{learner}' calls an array '{taken}', which is taken; call it otherwise")
            return weights


def equal_rounds(count: int, rounds: int) -> tuple[int, ...]:
    """Number of samples after each of so many equal rounds; fewer where there are too few samples."""
    return tuple(sorted({round(count * number / rounds) for number in range(1, rounds + 1)} - {0}))


PUPIL = "pupil"
"""Who drives in an examination, in place of an agent."""
PROXY_ROUNDS = 4
"""Rounds in which a proxy teaches where the learner drives in it."""


@dataclass(frozen=True)
class CurvePoint:
    """One point of a learning curve."""

    name: str  # the proxy's, for error lines only
    proxy: learning.Distribution | None  # p(θ) of the proxy, if one taught first
    repetition: int  # of which learners with and without a proxy share the target samples
    count: int  # target samples after that


@dataclass(frozen=True)
class TeachingSetup:
    """A learning experiment ready to run: both families, the learner, how much of what, and the cache of it all."""

    proxy: Classroom
    target: Classroom
    learner: learning.Learner
    learner_identity: str  # a digest of the learner's code and settings
    settings: learning.TeachingSettings
    seed: int  # the study's
    starts: int  # of an examination
    cache: learning.Cache
    timeout_s: float | None = None  # how long an episode of it or of a lesson may take [s], if limited

    @functools.cached_property
    def identities(self) -> tuple[str, str]:
        """Identities of the proxy's and the target's domain family, read once: reading digests the user's modules."""
        return self.proxy.identity, self.target.identity

    def score(self, point: CurvePoint) -> float:
        """Mean score in the target over all starts; NaN where nothing has been learnt, so nothing can drive."""
        with _name_proxy_in_errors(point), one_thread():
            found = self.cache.get("exam", self.exam_facts(point), lambda: self._examine(point))
            return float(np.mean(found["scores"]))

    def prepare(self, point: CurvePoint) -> None:
        """Make what a point shares with others: what the proxy alone has taught, and the target's samples."""
        with _name_proxy_in_errors(point), one_thread():
            stage = self._stage(point)
            stage.weights(0)
            for number in stage.lessons.rounds(point.count):
                stage.collect(number)

    def is_cached(self, point: CurvePoint) -> bool:
        """Tell whether the point's scores are in the cache."""
        return self.cache.has("exam", self.exam_facts(point))

    def exam_facts(self, point: CurvePoint) -> dict[str, Any]:
        """All that determines a point's scores: what is missing here would return stale scores."""
        weights = self._stage(point).weights_facts(point.count)
        return {
            "target": self.identities[1],
            "starts": self.starts,
            "seed": exam_seed(self.seed, 0),
            "weights": learning.facts_digest(weights) if weights else None,
        }

    def _stage(self, point: CurvePoint) -> Stage:
        """The stage in which a point's learner learns in the target, after its proxy if it has one."""
        taught, repetition, before = self.settings, point.repetition, None
        if point.proxy is not None:
            seed, ends = proxy_lessons_seed(self.seed, repetition), equal_rounds(taught.proxy_samples, PROXY_ROUNDS)
            before = Stage(self, repetition, self._lessons("proxy", point.proxy, seed, ends, taught.proxy_lessons))
        seed, ends = target_lessons_seed(self.seed, repetition), taught.target_samples[1:]
        lessons = self._lessons("target", learning.Distribution({}), seed, ends, taught.target_lessons)
        return Stage(self, repetition, lessons, before)

    def _lessons(self, domain: str, where: learning.Distribution, seed: int, ends: tuple[int, ...], by: str) -> Lessons:
        room, identity = self._room(domain), self.identities[int(domain == "target")]
        return Lessons(room, identity, where, seed, self.settings.lesson_s, ends, by == learning.LEARNER)

    def _room(self, domain: str) -> OnPolicyClassroom:
        family = self.proxy if domain == "proxy" else self.target
        return cast(OnPolicyClassroom, Supervised(family, domain, self.timeout_s))

    def _examine(self, point: CurvePoint) -> learning.Arrays:
        if (weights := self._stage(point).weights(point.count)) is None:
            return {"scores": np.full(self.starts, np.nan)}
        seeds = [exam_seed(self.seed, start) for start in range(self.starts)]
        episodes = [make_episode({}, agent=PUPIL, start=start, seed=seed) for start, seed in enumerate(seeds)]
        policy = learning.policy_of(self.learner, weights)
        with watching("an examination"):
            return {"scores": np.array(learning.examine_policy(self._room("target"), episodes, policy))}


@contextmanager
def _name_proxy_in_errors(point: CurvePoint) -> Iterator[None]:
    """Put the proxy's name in front of an error."""
    try:
        yield
    except (LearnerError, EpisodeError) as problem:
        raise type(problem)(f"{point.name}: {problem}") from None


WIDTH = " width"
"""What the width of a parameter's distribution is called, after the parameter."""
ROUNDING = 1e-9
"""Share of a box by which a width may be larger."""
SLACK = 1.0 / 30.0
"""A parameter that PRPV has pinned down is still searched over this share of its box, to both sides."""


def search_space(
    settings: "StudySettings", widths: Mapping[str, tuple[float, float]], left: Mapping[str, tuple[float, float]]
) -> Space:
    """The box that is searched for PLV: centres where PRPV cannot tell θ from the best, and widths as asked for.

    Args:
        settings: Of the study.
        widths: Bounds of the width of each parameter's distribution, by parameter.
        left: The ends of what PRPV cannot tell from the best, by parameter; empty where the box is not narrowed.

    Raises:
        SettingsError: If a width is of a parameter that is not searched, or wider than its box.
    """
    boxes = {box.name: box.high - box.low for box in settings.space.intervals}
    for name, (_, widest) in widths.items():
        key, whole = f"teaching.width.{name}", boxes.get(name)
        if whole is None:
            raise settings.error(key, "is not among [parameters]; add it there, or take this out")
        # 0.3 − 0.1 is a little less than 0.2.
        if widest > whole * (1.0 + ROUNDING):
            raise settings.error(key, f"must be at most {whole:g}, all of its box in [parameters], got {widest:g}")
    centres = [_narrowed(box, left.get(box.name)) for box in settings.space.intervals]
    return Space((*centres, *(Interval(name + WIDTH, *bounds) for name, bounds in sorted(widths.items()))))


def _narrowed(box: Interval, left: tuple[float, float] | None) -> Interval:
    if left is None:
        return box
    step = SLACK * (box.high - box.low)
    slack = step if left[1] - left[0] < step else 0.0
    return Interval(box.name, max(box.low, left[0] - slack), min(box.high, left[1] + slack), box.unit)


def distribution(setup: TeachingSetup, theta: Theta) -> learning.Distribution:
    """p(θ) with these centres and widths, cut off at what each parameter can be."""
    bounds = {}
    for name, centre in theta.items():
        if not name.endswith(WIDTH):
            half, known = theta.get(name + WIDTH, 0.0) / 2.0, setup.proxy.parameters[name]
            bounds[name] = (max(known.low, centre - half), min(known.high, centre + half))
    return learning.Distribution(bounds)
