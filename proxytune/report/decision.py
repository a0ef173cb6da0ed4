"""The decision of `score`: which agent to deploy, for people, as JSON, and drawn."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from proxytune.report import figure_style as style
from proxytune.report.score_figures import MOST, short_name
from proxytune.report.view import Table, columns_of
from proxytune.report.wording import as_known, listed, percent, plain, short, span, with_span
from proxytune.usefulness import Assessment, Decision, Panel, Plan, Saving, Selection, Sequential, mmrv_conventions


def decision_sentence(assessment: Assessment, target: str) -> str:
    """Say which agent to deploy, what it risks, and which others may be as good."""
    decision, where = assessment.decision, f"on {target}"
    winners = _few(decision.observed.proxy_winners)
    observed = f"the proxy's winner is the target's ({winners})"
    if not decision.observed.agrees:
        wins = "win" if len(decision.observed.proxy_winners) > 1 else "wins"
        cost = short(decision.observed.regret, 2)
        observed = f"in the proxy {winners} {wins}, which by the target's means costs {cost}"
    if decision.probability_best is None:
        best = decision.observed.target_winners
        are = f"{_few(best)} tie as the best" if len(best) > 1 else f"{best[0]} is the best"
        return f"By the means as published, {are} {where}; {observed}."
    risk = f"{percent(min(decision.probability_best, 0.9999))} to be the best {where}, expected regret "
    risk += f"{short(decision.expected_regret[decision.winner], 2)} in {decision.chosen_on}"
    others = decision.not_told_apart
    rest = f"{_few(others)} cannot be told from it" if others else "no other agent can be as good with 95 %"
    return f"Deploy {decision.winner}: {risk}; {rest}. {observed[0].upper()}{observed[1:]}."


def _few(names: tuple[str, ...]) -> str:
    return listed(list(names)) if len(names) <= 4 else f"{', '.join(names[:3])} and {len(names) - 3} others"


def saving_sentence(saving: Saving) -> str:
    """Say what the proxy's rollouts are worth in real ones."""
    worth = saving.real_rollouts_worth
    if worth is None or saving.interval is None:
        return f"what simulation saves is not known: {saving.reason}"
    if saving.reason:
        return f"simulation saves no real rollouts: {saving.reason}"
    rollouts = with_span(short(worth, 2), *saving.interval)
    how = "by paired starts" if saving.kind == "paired" else "by what the proxy foretells over agents, not by pairs"
    if saving.simulated <= 1.0:  # a mean, of who knows how many
        return f"the one simulated row of an agent is worth {rollouts} real rollouts, {how}"
    return f"{saving.simulated:.0f} simulated rollouts of an agent are worth {rollouts} real ones, {how}"


def next_sentence(plan: Plan, target: str) -> str:
    """Say what to do next on the target."""
    bound = short(plan.bound, 2)
    if plan.reason:
        return f"no number of further rollouts can be given: {plan.reason}"
    if not plan.rollouts:
        return f"regret is below {bound} with 95 %: no more rollouts are needed on {target} for that"
    rows = [f"{n} of {agent}" for agent, n in sorted(plan.rollouts.items(), key=lambda one: -one[1])]
    text = f"for a regret below {bound} with 95 %, {plan.total} more rollouts on {target}: {_few(tuple(rows))}"
    return text if plan.without_proxy is None else f"{text} ({plan.without_proxy} without the proxy)"


def sequential_sentence(found: Sequential) -> str:
    """Say what may be concluded after these rollouts, looked at after each."""
    each = f"{'rollouts' if found.independent == 1.0 else 'starts, the repeats of one being one score,'} of each"
    if found.winner is not None:
        return f"{found.winner} is shown to be the best, after {found.decided_at} of {found.rounds} {each} agent"
    times = [f"{name} {'over 1000' if n is None else n}" for name, n in found.expected_rounds.items()]
    lead = max(found.evidence, key=lambda agent: found.evidence[agent])
    wealth = f"{lead} has most evidence, {short(found.evidence[lead])} of {short(found.threshold)}"
    return f"none is shown to be the best after {found.rounds} {each} ({wealth}); expect {', '.join(times)}"


def decision_table(assessment: Assessment, target: str) -> Table:
    """Each agent's score, chance to be the best and expected regret, with what follows below."""
    decision, saving, plan = assessment.decision, assessment.saves, assessment.next
    rows = []
    for agent in sorted(decision.expected_regret, key=lambda one: decision.expected_regret[one]):
        scored = decision.scores[agent] if decision.scores else None
        ends = decision.regret_interval[agent] if decision.regret_interval else (None, None)
        chance = decision.best_probabilities[agent] if decision.best_probabilities else None
        rows.append((
            agent,
            f"{as_known(*scored)} ({span(scored[1])})" if scored else "–",
            "–" if chance is None else "> 0.99" if 0.995 <= chance < 1.0 else f"{chance:.2g}",
            with_span(decision.expected_regret[agent], *ends),
            str(plan.rollouts.get(agent, "")),
        ))  # fmt: skip
    heads = (f"{decision.chosen_on} on the target", "best with", "expected regret", "more rollouts")
    notes = [*decision.notes]
    if decision.least_told is not None and decision.least_told > 0.0:
        notes.append(f"with so many rollouts differences below {short(decision.least_told, 2)} cannot be told apart")
    notes += [saving_sentence(saving), next_sentence(plan, target)]
    if decision.without:
        right = sum(panel.agrees is True for panel in decision.without)
        alone = sum(panel.agrees is True for panel in decision.tasks)
        cases = f"in {right} of {len(decision.without)} cases with one task left out"
        notes.append(f"the proxy's winner is the target's in {alone} of {len(decision.tasks)} tasks alone, and {cases}")
    title = f"Which agent to deploy on {target}, chosen on {decision.chosen_on}"
    return Table(title, columns_of(("agent",), heads), tuple(rows), tuple(notes))


def decision_figure(decision: Decision) -> Figure:
    """Draw the expected regret of each agent with its interval, the best on top."""
    order = sorted(decision.expected_regret, key=lambda agent: decision.expected_regret[agent])[:MOST]
    figure, axes = style.one_panel(0.9 + 0.16 * max(4, len(order)))
    for row, agent in enumerate(order):
        near = agent in decision.not_told_apart
        colour = style.BLUE if agent == decision.winner else style.LIGHT_BLUE if near else style.GREY
        if decision.regret_interval is not None:
            axes.plot(decision.regret_interval[agent], (row, row), color=colour, linewidth=1.4, solid_capstyle="butt")
        axes.plot(decision.expected_regret[agent], row, "o", color=colour, markersize=4, clip_on=False, zorder=3)
        if decision.best_probabilities is not None:
            text = f"{decision.best_probabilities[agent]:.2f}"
            axes.text(1.02, row, text, transform=axes.get_yaxis_transform(), fontsize=7, va="center")
    axes.set_yticks(np.arange(len(order)), [short_name(agent) for agent in order])
    axes.set_ylim(len(order) - 0.5, -0.5)
    axes.set_xlim(left=0.0)
    style.dress(axes, f"regret in {plain(decision.chosen_on)[:44]}")
    axes.tick_params(axis="y", labelsize=7, length=0)
    if decision.best_probabilities is not None:
        axes.text(1.02, 1.0, "P(best)", transform=axes.transAxes, fontsize=7, va="bottom")
    return figure


def _saves(saving: Saving) -> dict[str, Any]:
    return {
        "real_rollouts_worth": saving.real_rollouts_worth,
        "interval": list(saving.interval) if saving.interval else None,
        "by": saving.kind,
        "correlation": saving.correlation,
        "real_rollouts": saving.real,
        "simulated_rollouts": saving.simulated,
        "saved_share": saving.saved_share,
        "scores": _scores(saving.means),
        "scores_alone": _scores(saving.alone),
        "reason": saving.reason or None,
    }


def _scores(scores: Mapping[str, tuple[float, tuple[float, float]]]) -> dict[str, Any]:
    return {agent: {"value": mean, "interval": list(ends)} for agent, (mean, ends) in scores.items()}


def _chosen(decision: Decision) -> dict[str, Any]:
    ends, chances = decision.regret_interval, decision.best_probabilities
    return {
        "winner": decision.winner,
        "probability_best": decision.probability_best,
        "expected_regret": dict(decision.expected_regret),
        "regret_interval": ends and {agent: list(own) for agent, own in ends.items()},
        "probabilities_best": chances and dict(chances),
        "not_told_apart": list(decision.not_told_apart),
        "chosen_on": decision.chosen_on,
        "scores": decision.scores and _scores(decision.scores),
        "least_difference": decision.least_told,
        "basis": decision.basis or None,
        "notes": list(decision.notes),
    }


PROMISED = ("winner", "probability_best", "expected_regret", "not_told_apart", "chosen_on")
"""What is told of a decision by two proxies together."""


def decision_document(assessment: Assessment) -> dict[str, Any]:
    """The decision and what follows from it, as plain JSON whose keys are promises."""
    decision, plan, random = assessment.decision, assessment.next, assessment.chance
    return {
        "decision": _chosen(decision),
        "observed": {
            **_panel(decision.observed),
            "tasks": {panel.name: _panel(panel) for panel in decision.tasks},
            "without_task": {panel.name: _panel(panel) for panel in decision.without},
        },
        "p_exact": random.p_value if random.exact else None,
        "saves": _saves(assessment.saves),
        "next": dict(plan.rollouts),
        "next_bound": {
            "regret": plan.bound,
            "now": plan.regret_bound,
            "rollouts": plan.total,
            "without_proxy": plan.without_proxy,
            "reason": plan.reason or None,
        },
        "mmrv_conventions": mmrv_conventions(assessment.inputs),
    }


def together_document(selection: Selection) -> dict[str, Any] | None:
    """What the two best proxies save together, and the agent to deploy then, as plain JSON; None where two are not."""
    if (both := selection.together) is None:
        return None
    return {
        "proxies": list(both.proxies),
        "saves": _saves(both.saves),
        "decision": {key: value for key, value in _chosen(both.decision).items() if key in PROMISED},
    }


def choices_sentences(assessments: Mapping[str, Assessment], selection: Selection, target: str) -> list[str]:
    """Say of every proxy what it would have chosen and saves, and of which two the choice differs beyond noise."""
    lines = []
    for name, one in assessments.items():
        regret = short(one.decision.expected_regret[one.decision.chosen_by_proxy], 2)
        winners = _few(one.decision.observed.proxy_winners)
        most = "up to " if len(one.decision.observed.proxy_winners) > 1 else ""
        told = f"chooses {winners}, at an expected regret of {most}{regret}"
        lines.append(f"{name}: {told}; {saving_sentence(one.saves)}")
    for choice in selection.choices:
        if choice.value > 0.0 or choice.on == "rollouts":
            told = {True: "beyond noise", False: "not beyond noise", None: "noise not known"}[choice.beyond_noise]
            gain = with_span(short(choice.value, 2), choice.low, choice.high)
            if choice.on == "rollouts":
                lines.append(f"{choice.better} saves {gain} real rollouts of an agent more than {choice.worse}, {told}")
            else:
                lines.append(f"choosing by {choice.better} instead of {choice.worse} gains {gain} on {target}, {told}")
    if (both := selection.together) is None:
        return lines
    names, decision = " and ".join(both.proxies), both.decision
    risk = f"deploy {decision.winner}, at an expected regret of {short(decision.expected_regret[decision.winner], 2)}"
    return [*lines, f"{names} together: {saving_sentence(both.saves)}; {risk}"]


def _panel(panel: Panel) -> dict[str, Any]:
    return {
        "proxy_winner": panel.proxy_winners[0],
        "target_winner": panel.target_winners[0],
        "regret": panel.regret,
        "agrees": panel.agrees,
        "proxy_winners": list(panel.proxy_winners),
        "target_winners": list(panel.target_winners),
        "expected_regret": panel.expected_regret and dict(panel.expected_regret),
    }
