"""Numbers and names as people read them: no more digits than are known, with a true minus sign."""

import math
from collections.abc import Sequence

Ends = tuple[float, float]
LARGEST_WHOLE = 1e7
"""Beyond this a number has an exponent."""


def digits(ends: Ends) -> int:
    """Decimals that give the width of an interval two significant figures."""
    width = abs(ends[1] - ends[0])
    return max(0, 1 - math.floor(math.log10(width))) if width > 0.0 else 3


def fixed(value: float, decimals: int) -> str:
    """A number with so many decimals, to tens where these are −1; one that rounds to zero has no sign."""
    text = f"{round(value, decimals):.{max(0, decimals)}f}"
    return text.lstrip("-") if float(text) == 0.0 else text.replace("-", "−")


def short(value: float, figures: int = 3) -> str:
    """A number of three significant figures, or all before the point; of four where it is to be used again."""
    whole = 10**figures - 0.5 <= abs(value) < LARGEST_WHOLE
    return (f"{value:.0f}" if whole else f"{value:.{figures}g}").replace("-", "−")


def span(ends: Ends, decimals: int | None = None) -> str:
    """An interval with the decimals that its width allows, as "0.108 to 0.146"."""
    places = digits(ends) if decimals is None else decimals
    return f"{fixed(ends[0], places)} to {fixed(ends[1], places)}"


def as_known(value: float, ends: Ends) -> str:
    """A number with the decimals that its interval allows."""
    return fixed(value, digits(ends))


def short_span(low: float | None, high: float | None) -> str:
    """An interval of three significant figures; empty where an end is not known."""
    return "" if low is None or high is None else f"{short(low)} to {short(high)}"


def with_span(value: float | str, low: float | None, high: float | None) -> str:
    """A number with its interval in brackets, where that is known; a text is taken as the number stands."""
    ends, text = short_span(low, high), value if isinstance(value, str) else short(value)
    return f"{text} ({ends})" if ends else text


def pairs_span(low: float, high: float) -> str:
    """An interval of PRPV in whole pairs, rounded outwards."""
    return f"{fixed(math.floor(low), 0)} to {fixed(math.ceil(high), 0)}"


def in_pairs(value: float, low: float, high: float) -> str:
    """PRPV in whole pairs with its interval."""
    return f"{fixed(value, 0)} ({pairs_span(low, high)})"


def percent(share: float) -> str:
    """A share in per cent, of two significant figures; near all, or above, of three."""
    if share < 0.0:
        return f"−{percent(-share)}"
    if 0.0 < share < 1e-5:
        return "under 0.001 %"
    if 0.999 < share < 1.0:
        return "over 99.9 %"
    return f"{float(f'{100.0 * share:.{3 if share >= 0.995 else 2}g}'):g} %"


def probability(p_value: float) -> str:
    """A p-value, as "p = 0.36" or "p < 0.001"."""
    return "p < 0.001" if p_value < 0.001 else f"p = {p_value:.2g}"


def listed(names: Sequence[str]) -> str:
    """Names as a list in a sentence: "a", "a and b", "a, b and c"."""
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]])) if names else ""


def plain(name: str) -> str:
    """The name of an effect as words; one's own, module:Attribute, as it is written in θ."""
    return name if ":" in name else name.replace("_", " ")


def with_unit(name: str, unit: str) -> str:
    """The name of a parameter or measure for an axis, with its unit in brackets."""
    return f"{plain(name)} [{unit}]" if unit else plain(name)
