"""How often the diagnosis of a camera is right on blind sets: rates with their counts, and who was taken for whom."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from camera_truth.answers import Answer
from camera_truth.cases import CHANGES, DECLARED, GEOMETRIC, LIGHT, OUTSIDE, PAIRS, TIMED

EXAM = 1000
"""Seeds of an examination begin here; smaller ones are to develop on."""

SETS = {
    "none": 20,
    **dict.fromkeys(DECLARED, 6),
    **dict.fromkeys(GEOMETRIC, 8),
    **dict.fromkeys(TIMED, 8),
    **dict.fromkeys(LIGHT, 4),
    **dict.fromkeys(OUTSIDE, 12),
    **dict.fromkeys(PAIRS, 1),
}
"""How many sets of each case an examination has."""


def all_sets(cases: Sequence[str] = (), every: int = 1) -> list[tuple[str, int]]:
    """Case and seed of every n-th set of each kind, mixed so that any beginning has a share of each."""
    kinds = [SETS.keys() - PAIRS, PAIRS] if not cases else [cases]
    sets = []
    for kind in kinds:
        of_kind = [(name, EXAM + number) for name in kind for number in range(SETS.get(name, 4))]
        sets += sorted(of_kind)[::every]
    counts = Counter(name if name not in PAIRS else "pair" for name, _ in sets)
    done: Counter[str] = Counter()
    placed = []
    for name, seed in sets:
        kind = name if name not in PAIRS else "pair"
        placed.append(((done[kind] + 0.5) / counts[kind], name, seed))
        done[kind] += 1
    return [(name, seed) for _, name, seed in sorted(placed)]


@dataclass(frozen=True)
class Rate:
    """So many of so many."""

    hits: int
    of: int

    def __str__(self) -> str:
        return f"{self.hits} of {self.of}" + (f" ({100.0 * self.hits / self.of:.0f} %)" if self.of else "")


def rates(answers: Sequence[Answer]) -> dict[str, Rate]:
    """How often the diagnosis is right, by what was wrong with the camera; those that failed count for that alone."""
    sound = [one for one in answers if not one.problem]
    whole = [one for one in sound if not one.outside]
    clean = [one for one in whole if not one.missing]
    outside = [one for one in sound if one.outside]
    pairs = [one for one in whole if len(one.missing) > 1]
    lone = [one for one in whole if len(one.missing) == 1]
    told = {}
    for title, group in (("geometric", GEOMETRIC), ("timed", TIMED), ("light", LIGHT)):
        of_group = [one for one in lone if one.missing[0] in group]
        told[f"{title}: named"] = _rate(of_group, lambda one: one.right)
        told[f"{title}: named, nothing beside"] = _rate(of_group, lambda one: one.right and not one.surplus)
        told[f"{title}: named by itself, no rival"] = _rate(of_group, lambda one: set(one.missing) == one.first_names)
        told[f"{title}: wrong without a flag"] = _rate(of_group, _is_wrong)
    return told | {
        "pairs: both named": _rate(pairs, lambda one: one.right),
        "pairs: both named, nothing beside": _rate(pairs, lambda one: one.right and not one.surplus),
        "nothing missing: false alarms": _rate(clean, lambda one: bool(one.named) or one.flagged),
        "outside: flagged": _rate(outside, lambda one: one.flagged),
        "outside: called explained or nothing missing": _rate(outside, lambda one: _is_calm(one) and not one.flagged),
        "failed": _rate(answers, lambda one: bool(one.problem)),
    }


def coverage(answers: Sequence[Answer]) -> dict[str, Rate]:
    """How often intervals hold the truth, by parameter, where nothing outside the catalogue is wrong."""
    held: dict[str, list[bool]] = {}
    for answer in answers:
        if not answer.outside and answer.right:
            for name, (low, true, high) in answer.intervals().items():
                held.setdefault(name, []).append(low <= true <= high)
    each = {name: Rate(sum(flags), len(flags)) for name, flags in sorted(held.items())}
    return each | {"all": Rate(sum(one.hits for one in each.values()), sum(one.of for one in each.values()))}


WITHIN = {
    "camera_pitch": 0.3,
    "camera_roll": 0.3,
    "camera_yaw": 0.5,
    "camera_height": 0.002,
    "field_of_view": 1.0,
    "lens_distortion": 0.02,
    "camera_latency": 0.005,
    "blur": 0.010,
    "vignetting": 0.03,
}
"""How near the truth a figure is to come, in its unit."""


def accuracy(answers: Sequence[Answer]) -> dict[str, Rate]:
    """How often figures come so near the truth, where nothing outside the catalogue is wrong."""
    near: dict[str, list[bool]] = {}
    for answer in answers:
        for name, (_, true, _) in ({} if answer.outside else answer.intervals()).items():
            if name in WITHIN:
                value = answer.camera["extended"][name]["value"]
                near.setdefault(f"{name} within {WITHIN[name]:g}", []).append(abs(value - true) <= WITHIN[name])
    return {name: Rate(sum(one), len(one)) for name, one in sorted(near.items())}


def confusion(answers: Sequence[Answer]) -> str:
    """For everything that was wrong what was said, and how often."""
    said: dict[str, Counter[str]] = {}
    for answer in answers:
        names = " + ".join(sorted(answer.first_names)) or "-"
        truth = " + ".join(answer.truth["effects"]) or "none"
        said.setdefault(truth, Counter())[f"{names} ({answer.verdict})"] += 1
    order = {name: number for number, name in enumerate(("none", *CHANGES))}
    return "\n".join(
        f"{truth:34s} {', '.join(f'{name} {count}' for name, count in counts.most_common())}"
        for truth, counts in sorted(said.items(), key=lambda pair: (order.get(pair[0], len(order)), pair[0]))
    )


def _is_calm(answer: Answer) -> bool:
    return answer.verdict in ("explained", "nothing missing")


def _is_wrong(answer: Answer) -> bool:
    """Whether an effect was named that is not missing, or none was, and nothing was said to be left over."""
    return not answer.flagged and (bool(answer.surplus) or (not answer.right and _is_calm(answer)))


def _rate(answers: Sequence[Answer], hit: Callable[[Answer], bool]) -> Rate:
    return Rate(sum(map(hit, answers)), len(answers))
