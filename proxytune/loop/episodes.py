"""A loop that has come to its end, and the agent that it has righted, on its way beside the target.

Righted is the agent that most wrongly ordered pairs lose. It is driven in the proxy tuned before and in the extended
one after, from the start in which the first is furthest from the target, and a picture of either is kept.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from proxytune.api import StudyReport
from proxytune.domain import DomainFamily, make_episode
from proxytune.errors import EpisodeError, StoreError
from proxytune.loop.opening import Loop
from proxytune.report import Picture, episode_figure, plain, save_figure, say_parting, short, svg_of, write_text
from proxytune.seeds import episode_seed
from proxytune.study import SideBySide, can_record, drive_side_by_side, load_family
from proxytune.usefulness import Assessment, dominance


@dataclass(frozen=True)
class Closed:
    """A loop that has come to its end."""

    loop: Loop
    before: StudyReport  # the study
    diagnosis: Mapping[str, Any]  # what `diagnose --json` prints of the log
    after: StudyReport | None  # the extended study; None where nothing was found
    held_out: tuple[Assessment, Assessment] | None  # of held-out agents in both tuned proxies; None likewise
    done: tuple[str, ...]  # the steps that this run has done or gone on with
    episodes: int  # how many this run has driven


def righted(closed: Closed) -> dict[str, Any] | None:
    """The agent that most wrongly ordered pairs lose, a held-out one where there are any; None where none loses any."""
    if closed.after is None:
        return None
    both = closed.held_out or (closed.before.result.judged, closed.after.result.judged)
    # Pairs with each agent that proxy and target order differently; a tie of one side alone counts half.
    orders = ([dominance(means, one.inputs.metrics) for means in one.inputs.means] for one in both)
    before, after = (np.abs(proxy - target).sum(axis=1).tolist() for proxy, target in orders)
    gains = np.subtract(before, after)
    if gains.max() <= 0.0:
        return None
    most = int(gains.argmax())
    return {"agent": both[0].inputs.agents[most], "wrong_pairs_before": before[most], "wrong_pairs_after": after[most]}


MOST_STARTS = 4
"""The start that is shown is one of the first so many: each is driven to choose it."""


def pictures_file(home: Path) -> Path:
    """The file in which a loop keeps titles and captions of the pictures that lie beside them."""
    return home / "righted" / "pictures.json"


def write_pictures(closed: Closed) -> None:
    """Drive the righted agent, and keep a picture of it before and after; none without such an agent, or a twin."""
    path, gain = pictures_file(closed.loop.home), righted(closed)
    both = drive_both(closed, gain["agent"]) if gain else None
    texts = []
    if gain and both:
        metrics = [metric.name for metric in closed.loop.settings.metrics]
        agent, start, starts = gain["agent"], both["before"].episode.start, _starts(closed)
        pairs = f"{short(gain['wrong_pairs_before'])} before, {short(gain['wrong_pairs_after'])} after"
        chosen = f", where of starts 0 to {starts[-1]} the two are furthest apart on average" if starts[1:] else ""
        first = (
            f"Wrongly ordered pairs with {agent}: {pairs}. Here it drives in the proxy tuned before and in the target, "
            f"under the same seed from start {start}{chosen}."
        )
        before, after = (f"{say_parting(pair)} {_scores(pair, metrics)}" for pair in both.values())
        rest = "This is one episode; the order of the agents counts every start, under other seeds."
        captions = f"{first} {before}", f"The same start and seed in the extended proxy. {after} {rest}"
        for (name, pair), caption in zip(both.items(), captions, strict=True):
            drawn = episode_figure(pair, metrics)
            save_figure(drawn, path.with_name(f"{name}.png"))
            write_text(path.with_name(f"{name}.svg"), svg_of(drawn).decode("utf-8"))
            texts.append({"file": f"{name}.svg", "title": f"{agent} beside the target, {name}", "caption": caption})
    write_text(path, json.dumps(texts, indent=2) + "\n")


def read_pictures(home: Path) -> list[Picture]:
    """The pictures that were kept."""
    path = pictures_file(home)
    try:
        return [
            Picture(_text(one["title"]), path.with_name(one["file"]).read_bytes(), _text(one["caption"]))
            for one in json.loads(path.read_text(encoding="utf-8"))
        ]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        raise StoreError(f"{path}: cannot be read; remove it to draw the righted agent again") from None


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError("not a text")
    return value


def drive_both(closed: Closed, agent: str) -> dict[str, SideBySide] | None:
    """Drive an agent before and after, from the start in which it is furthest off before; None without a twin."""
    loop = closed.loop
    if loop.twin is None or closed.after is None or not can_record(loop.family):
        return None
    twin = load_family(loop.settings, loop.twin)
    known = [pair for start in _starts(closed) if (pair := _drive(closed.before, twin, agent, start))]
    if not known:
        return None
    start = max(known, key=mean_gap_m).episode.start
    before, after = (_drive(report, twin, agent, start, filmed=True) for report in (closed.before, closed.after))
    return {"before": before, "after": after} if before and after else None


def mean_gap_m(pair: SideBySide) -> float:
    """The mean distance of proxy and target [m]; a robot whose episode has ended stays where it is."""
    sides = [episode.poses for episode in pair.sides.values()]
    times = max((poses["time"] for poses in sides), key=lambda time: float(time[-1]))
    here, there = ([np.interp(times, poses["time"], poses[name]) for name in ("x", "y")] for poses in sides)
    return float(np.hypot(*np.subtract(here, there)).mean())


def _drive(
    report: StudyReport, twin: DomainFamily, agent: str, start: int, *, filmed: bool = False
) -> SideBySide | None:
    """The episode that `drive` shows of a study; None where it fails, or places are not kept."""
    study = report.result.study
    episode = make_episode(report.theta, agent=agent, start=start, seed=episode_seed(study.settings.seed, start))
    try:
        pair = drive_side_by_side(episode, proxy=study.family, target=twin, filmed=filmed)
    except EpisodeError:
        return None
    return pair if all(side.has_places for side in pair.sides.values()) else None


def _starts(closed: Closed) -> range:
    return range(min(MOST_STARTS, closed.loop.settings.starts))


def _scores(pair: SideBySide, metrics: list[str]) -> str:
    """The compared metrics of proxy and target, as a sentence."""
    values = [
        ", ".join(f"{plain(name)} {short(side.metrics[name])} {pair.units[name]}".rstrip() for name in metrics)
        for side in pair.sides.values()
    ]
    return "; ".join(f"{side}: {value}" for side, value in zip(pair.sides, values, strict=True)).capitalize() + "."
