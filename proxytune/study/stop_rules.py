"""Rules that end a study before its budget is spent, as study.toml gives them."""

from dataclasses import dataclass

from proxytune.settings import Section


@dataclass(frozen=True)
class StopRules:
    """When a study ends before its budget is spent; None where a rule is not asked for.

    Attributes:
        wall_time_s: After the trial with which its episodes have taken so long [s], all runs together.
        no_improvement: Once the most that any θ is expected to improve the score is less than this, in standard
            deviations of the score's noise.
    """

    wall_time_s: float | None = None
    no_improvement: float | None = None


def read_stop_rules(rules: Section) -> StopRules:
    """The rules of a table [stop].

    Raises:
        SettingsError: With the key and the remedy.
    """
    rules.only(("wall_time_s", "no_improvement"))
    return StopRules(positive(rules, "wall_time_s"), positive(rules, "no_improvement"))


def positive(table: Section, key: str) -> float | None:
    """A number above 0; None where it is missing.

    Raises:
        SettingsError: If it is none.
    """
    if key not in table.values:
        return None
    value = table.number(key)
    if value <= 0.0:
        raise table.error(key, f"must be above 0, got {value:g}; remove it to have no such rule")
    return value
