"""Which simulator to use, and for what, in sentences that claim no more than the intervals allow."""

from proxytune.learning import Estimate
from proxytune.report.numbers import fixed, listed, short
from proxytune.report.teaching.table import UNKNOWN, count
from proxytune.study import ComparedFamilies, Lesson
from proxytune.usefulness import Assessment, Difference

NOT_APART = "cannot be told from it"


def families_sentence(compared: ComparedFamilies) -> str:
    """What to use to predict, to teach and where time is short, and what to do next."""
    return f"{families_answer(compared)} Next: {families_next_step(compared)}"


def families_answer(compared: ComparedFamilies) -> str:
    """What to use to predict, to teach and where time is short."""
    teach = [f"To teach: {_say_teaching(compared)}."] if compared.settings.teaching else []
    return " ".join([f"To predict: {_say_predicting(compared)}.", *teach, f"Cheapest: {_say_cost(compared)}."])


def families_next_step(compared: ComparedFamilies) -> str:
    """The step that brings most."""
    choice, fresh = compared.predicts, {one.name: one.fresh for one in compared.families}
    best = fresh.get(choice.best or "")
    if best is None:
        return "run the study again, to drive every family's best θ afresh."
    if best.chance.explains:
        return f"raise stop.wall_time_s (now {compared.settings.stop.wall_time_s:g}), or add agents that differ more."
    told = "raise starts and measure the target from them too"
    if not choice.alike:
        return f"use {choice.best} to predict; its page: {_page(compared, choice.best)}."
    cheap = _cheaper(compared)
    if cheap:
        return f"use {cheap} to predict, which costs least of those; to tell them apart, {told}."
    return f"to tell {listed([choice.best or '', *choice.alike])} apart, {told}."


def prpv_text(fresh: Assessment) -> str:
    """PRPV with its interval."""
    inner = fresh.prpv_interval
    ends = "" if inner.low is None or inner.high is None else f" ({short(inner.low)} to {short(inner.high)})"
    return f"{fresh.prpv.value}{ends}"


def difference_text(one: Difference) -> str:
    """How much higher one PRPV is than another, with its interval."""
    ends = "" if one.low is None or one.high is None else f" ({fixed(one.low, 0)} to {fixed(one.high, 0)})"
    return f"+{one.value}{ends}"


def seconds_text(value: float, low: float, high: float) -> str:
    """Seconds, or a ratio, with its interval."""
    return f"{_rounded(value)} ({_rounded(low)} to {_rounded(high)})"


def _rounded(value: float) -> str:
    """Two significant figures."""
    return f"{float(f'{value:.2g}'):g}"


def more_text(lesson: Lesson) -> str:
    """How many more target samples it takes, with the interval; why that is not known."""
    if lesson.failure:
        return "cannot teach"
    return "" if lesson.more is None else count(lesson.more, UNKNOWN)


def differences(compared: ComparedFamilies) -> dict[str, Difference]:
    """How much higher the PRPV of each family is than the lowest, by name."""
    found = compared.selection.differences if compared.selection else ()
    return {one.worse: one for one in found if one.better == compared.predicts.best}


def _say_predicting(compared: ComparedFamilies) -> str:
    choice = compared.predicts
    fresh = next((one.fresh for one in compared.families if one.name == choice.best), None)
    if fresh is None or compared.selection is None:
        return "not known, since no family has fresh episodes"
    score = f"fresh PRPV (proxy relative predictivity value) {prpv_text(fresh)}"
    if fresh.chance.explains:
        return f"none is shown to be better than chance; lowest is {choice.best}, {score}"
    if compared.selection.reason:
        return f"{choice.best}, {score}; by how much is not known: {compared.selection.reason}"
    more = differences(compared)
    alike = [f"{name} {difference_text(more[name])}" for name in choice.alike]
    worse = [f"{name} {difference_text(one)}" for name, one in more.items() if name not in choice.alike]
    clauses = [f"worse: {'; '.join(worse)}" if worse else "", f"{NOT_APART}: {'; '.join(alike)}" if alike else ""]
    return "; ".join(filter(None, [f"{choice.best}, {score}", *clauses]))


def _say_teaching(compared: ComparedFamilies) -> str:
    choice, lessons = compared.teaches, compared.lessons
    if choice.best is None:
        why = "nothing was taught yet" if not lessons else "learners have not converged; raise teaching.target_samples"
        return f"PLV (proxy learning value) is not known, {why}"
    worth = f"PLV (proxy learning value) {_plv(lessons[choice.best].plv)} target samples saved"
    highest = lessons[choice.best].plv
    if highest is None or not highest.above_zero:
        return f"none is shown to save target samples; highest is {choice.best}, {worth}"
    others = [name for name in lessons if name not in (choice.best, *choice.alike)]
    alike = [f"{name}, {more_text(lessons[name])} more samples" for name in choice.alike]
    worse = [f"{name}, {_behind(lessons[name])}" for name in others]
    clauses = [f"worse: {'; '.join(worse)}" if worse else "", f"{NOT_APART}: {'; '.join(alike)}" if alike else ""]
    return "; ".join(filter(None, [f"{choice.best}, {worth}", *clauses]))


def _behind(lesson: Lesson) -> str:
    if lesson.failure:
        return "which cannot teach"
    return "not converged" if lesson.more is None else f"{more_text(lesson)} more samples"


def _plv(plv: Estimate | None) -> str:
    return UNKNOWN if plv is None else count(plv, UNKNOWN)


def _say_cost(compared: ComparedFamilies) -> str:
    choice = compared.cheapest
    assert choice.best is not None
    value, *ends = compared.seconds_per_episode()[choice.best]
    times = {name: seconds_text(*one) for name, one in compared.times_cheapest(choice.best).items()}
    alike = [f"{name} {times[name]}" for name in choice.alike]
    worse = [f"{name} {time}" for name, time in times.items() if name not in (choice.best, *choice.alike)]
    clauses = [
        f"times as long: {'; '.join(worse)}" if worse else "",
        f"{NOT_APART}: {'; '.join(alike)}" if alike else "",
    ]
    seconds = f"{_rounded(value)} s per episode ({_rounded(ends[0])} to {_rounded(ends[1])})"
    return "; ".join(filter(None, [f"{choice.best}, {seconds}", *clauses]))


def _cheaper(compared: ComparedFamilies) -> str:
    """Of those that predict alike the one whose episodes are shown to take the shortest; empty if none is."""
    choice = compared.predicts
    names = [choice.best or "", *choice.alike]
    means = {name: one[0] for name, one in compared.seconds_per_episode().items() if name in names}
    cheap = min(means, key=means.__getitem__)
    others = [one for name, one in compared.times_cheapest(cheap).items() if name in names and name != cheap]
    return cheap if all(low > 1.0 for _, low, _ in others) else ""


def _page(compared: ComparedFamilies, name: str | None) -> str:
    home = next(one.result.study.settings.home for one in compared.families if one.name == name)
    return str(home / "report.html")
