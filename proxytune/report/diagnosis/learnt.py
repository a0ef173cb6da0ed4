"""What was learnt beside the named effects, as JSON and as notes."""

from collections.abc import Mapping
from typing import Any

from proxytune.diagnosis import Learning, MatchedEffect, Ratio


def learnt_document(learning: Learning) -> dict[str, Any]:
    """The `learnt` part of `diagnose --json`: what the guard saw, and the error on drives that were not fitted.

    Keys of `ratio` and `guard` are horizons in seconds. `groups` and `share` are empty where nothing is used.
    """
    beside = learning.discrepancy
    share = beside.share if beside.used else {}
    return {
        "used": beside.used,
        "groups": list(learning.depends_on(())),
        "share": dict(share),
        "ratio": ratios_document({error.horizon_s: error.ratio for error in learning.errors}),
        "guard": ratios_document(beside.guard),
        "errors": [
            {
                "horizon_s": error.horizon_s,
                "after": error.after.value,
                "after_interval": list(error.after.interval),
                "heading": error.heading.value,
            }
            for error in learning.errors
        ],
        "names_doubtful": learning.names_doubtful,
        "looks_like": _lookalike(learning.looks_like),
    }


def _lookalike(like: MatchedEffect | None) -> dict[str, Any] | None:
    if like is None:
        return None
    return {"name": like.effect, "form": like.form, "values": dict(like.theta), "share": like.share}


def ratio_document(one: Ratio) -> dict[str, Any]:
    """One error by another, with its interval."""
    return {"value": one.value, "interval": list(one.interval)}


def ratios_document(ratios: Mapping[float, Ratio]) -> dict[str, dict[str, Any]]:
    """Such ratios by horizon in seconds."""
    return {f"{horizon_s:g}": ratio_document(one) for horizon_s, one in ratios.items()}


def learnt_notes(learning: Learning) -> list[str]:
    """What was learnt, in sentences; nothing where nothing was."""
    beside = learning.discrepancy
    notes = []
    curves = ", ".join(f"{title} ({100.0 * beside.share[title]:.0f} %)" for title in beside.share)
    if beside.used:
        worth = "; ".join(
            f"{error.horizon_s:g} s: {1e3 * error.after.value:.1f} mm, {error.ratio.value:.2f} "
            f"({error.ratio.interval[0]:.2f} … {error.ratio.interval[1]:.2f}) of that with names alone"
            for error in learning.errors
        )
        notes.append(f"learnt, not physics: curves over {curves}; position error with them at {worth}")
    elif beside.theta:
        notes.append(f"curves over {curves} were tried and dropped: they do not clearly help on drives left out")
    if learning.looks_like is not None:
        like = learning.looks_like
        values = ", ".join(f"{name} {value:.3g}" for name, value in like.theta.items())
        notes.append(
            f"the curves look like {like.effect} ({values}), which alone keeps {100.0 * like.share:.0f} % of it"
        )
    if learning.names_doubtful:
        notes.append(
            "beware: curves beside the declared model predict better than beside the named effects: the names are "
            "likely wrong"
        )
    return notes
