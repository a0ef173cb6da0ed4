"""What a study.toml compares: metrics, agents, and the files of the target's scores."""

from proxytune.errors import InputError
from proxytune.scores import Metric
from proxytune.settings import Section


def metrics_of(read: Section) -> tuple[Metric, ...]:
    """How agents are compared."""
    try:
        metrics = tuple(Metric.parse(text) for text in read.texts("metrics"))
    except InputError as problem:
        raise read.error("metrics", str(problem)) from None
    names = [metric.name for metric in metrics]
    if not names:
        raise read.error("metrics", 'is empty; give at least one, as in ["distance:max"]')
    if len(set(names)) < len(names):
        raise read.error("metrics", f"names a metric twice: {', '.join(names)}")
    return metrics


def agents_of(read: Section) -> tuple[str, ...]:
    """The agents, as tables have them."""
    agents = tuple(aliases_of(read)) or read.texts("agents")
    if len(agents) < 2:
        raise read.error("agents", f"comparing takes at least two agents, got {len(agents)}")
    return agents


def targets_of(read: Section) -> tuple[str, ...]:
    """The file of the target's scores, or several."""
    if not isinstance(read.values.get("target"), list):
        return (read.text("target"),)
    return read.texts("target") or (read.text("target"),)


def aliases_of(read: Section) -> dict[str, str]:
    """The table [agents], where it is one: name in tables to what is loaded."""
    return texts_of(read.section("agents")) if isinstance(read.values.get("agents"), dict) else {}


def texts_of(table: Section) -> dict[str, str]:
    """The texts of a table, by key."""
    return {name: table.text(name) for name in table.values}
