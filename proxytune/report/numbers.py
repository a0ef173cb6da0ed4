"""How numbers are written for people: no more digits than are known, with a true minus sign."""

import math

Ends = tuple[float, float]


def digits(ends: Ends) -> int:
    """Decimals that give the width of an interval two significant figures."""
    width = abs(ends[1] - ends[0])
    return max(0, 1 - math.floor(math.log10(width))) if width > 0.0 else 3


def fixed(value: float, decimals: int) -> str:
    """A number with so many decimals, to tens where these are −1; one that rounds to zero has no sign."""
    text = f"{round(value, decimals):.{max(0, decimals)}f}"
    return text.lstrip("-") if float(text) == 0.0 else text.replace("-", "−")


def short(value: float) -> str:
    """A number of three significant figures."""
    return f"{value:.3g}".replace("-", "−")


def span(ends: Ends, decimals: int | None = None) -> str:
    """An interval, as "0.108 to 0.146"."""
    places = digits(ends) if decimals is None else decimals
    return f"{fixed(ends[0], places)} to {fixed(ends[1], places)}"


def percent(share: float) -> str:
    """A share of the box in per cent, of two significant figures."""
    if share <= 0.0:
        return "0 %"
    return "under 0.001 %" if share < 1e-5 else f"{float(f'{100.0 * share:.2g}'):g} %"


def probability(p_value: float) -> str:
    """A p-value, as "p = 0.36" or "p < 0.001"."""
    return "p < 0.001" if p_value < 0.001 else f"p = {p_value:.2g}"


def listed(names: list[str]) -> str:
    """Names as a list in a sentence: "a", "a and b", "a, b and c"."""
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]])) if names else ""
