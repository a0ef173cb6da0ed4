"""Made-up evaluations whose truth is known: do the decision's intervals hold, is its regret calibrated, what is saved?

    nice python benchmarks/decisions.py [--runs 2000] > benchmarks/decisions.md

Every setting has its own seed, its place in the list. Nothing is asserted here; a small version is a slow test.
"""

import argparse
import time

import numpy as np

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import decision
from proxytune.usefulness.comparison import compare
from proxytune.usefulness.decision import ASKED, decide
from proxytune.usefulness.saving import saving_of
from proxytune.usefulness.sequential import plan, wealth_of

DRAWS = 1000
AGENTS, ROLLOUTS = (4, 8, 20), (10, 25, 100)
SUCCESS = [Metric("success")]


def table(values, labels=None, side="target"):
    """Scores of shape (agents, episodes); without labels no episode is one of the other side."""
    agents = tuple(f"agent {row}" for row in range(len(values)))
    labels = labels or tuple(f"{side}{place}" for place in range(values.shape[1]))
    return ScoreTable(agents, labels, ("success",), np.asarray(values, dtype=np.float64)[..., None])


def rolled(rates, rollouts, rng):
    """Successes at these rates, shape (agents, rollouts)."""
    return (rng.random((len(rates), rollouts)) < np.asarray(rates)[:, None]).astype(float)


def decisions(agents, rollouts, runs, seed, rates=None):
    """One line of figures: truths from the uniform prior, or at fixed rates."""
    rng, rows = np.random.default_rng(seed), []
    for _ in range(runs):
        truth = rng.random(agents) if rates is None else rng.permutation(np.resize(rates, agents))
        target = table(rolled(truth, rollouts, rng))
        found = decide(compare(proxy=target, target=target, metrics=SUCCESS), ASKED, None, int(rng.integers(2**31)))
        names, regret = list(target.agents), truth.max() - truth
        place = names.index(found.winner)
        held = [low <= rate <= high for (_, (low, high)), rate in zip(found.scores.values(), truth, strict=True)]
        spans = np.array([found.regret_interval[name] for name in names])
        tolerance = 1e-9
        covered = (spans[:, 0] - tolerance <= regret) & (regret <= spans[:, 1] + tolerance)
        best = names[int(truth.argmax())]
        rows.append((
            np.mean(held), np.mean(covered), found.expected_regret[found.winner], regret[place],
            found.probability_best, place == truth.argmax(), best == found.winner or best in found.not_told_apart,
            1 + len(found.not_told_apart),
        ))  # fmt: skip
    return np.mean(np.array(rows, dtype=float), axis=0)


def paired(rates, correlation, rng, real, simulated):
    """A proxy and a target of equal rates, whose rollouts from one start correlate so much within an agent."""
    rates = np.asarray(rates)[:, None]
    both = rates**2 + correlation * rates * (1 - rates)
    proxy = (rng.random((len(rates), simulated)) < rates).astype(float)
    given = np.where(proxy[:, :real] > 0, both / rates, (rates - both) / (1 - rates))
    target = (rng.random((len(rates), real)) < given).astype(float)
    labels = tuple(f"start{place}" for place in range(simulated))
    return table(proxy, labels), table(target, labels[:real])


def savings(correlation, agents, real, simulated, runs, seed):
    """Errors of the rectified means against the target's alone, coverage, and what is said to be saved."""
    rng, alone, rectified, said, held = np.random.default_rng(seed), [], [], [], []
    for _ in range(runs):
        truth = rng.uniform(0.15, 0.85, agents)
        proxy, target = paired(truth, correlation, rng, real, simulated)
        found = saving_of(compare(proxy=proxy, target=target, metrics=SUCCESS))
        means = found.rectified["success"][0] if "success" in found.rectified else target.means[:, 0]
        alone.append((target.means[:, 0] - truth) ** 2)
        rectified.append((means - truth) ** 2)
        said.append(found.saved_share or 0.0)
        ends = [found.means[name][1] for name in target.agents] if found.means else []
        held += [low <= rate <= high for (low, high), rate in zip(ends, truth, strict=False)]
    saved = 1.0 - np.mean(rectified) / np.mean(alone)
    return saved, np.mean(said), np.mean(held) if held else np.nan


def policies(spread, agents, real, simulated, runs, seed):
    """The same without pairs, by the model over agents; proxies that are off by so much in each agent's rate."""
    rng, alone, shrunken, held, said = np.random.default_rng(seed), [], [], [], []
    for _ in range(runs):
        truth = rng.uniform(0.1, 0.9, agents)
        in_proxy = rng.permutation(truth) if spread is None else np.clip(truth + spread * rng.normal(size=agents), 0, 1)
        proxy, target = table(rolled(in_proxy, simulated, rng), side="proxy"), table(rolled(truth, real, rng))
        found = saving_of(compare(proxy=proxy, target=target, metrics=SUCCESS))
        if not found.means:
            continue
        means = np.array([found.means[name][0] for name in target.agents])
        held += [
            found.means[n][1][0] <= rate <= found.means[n][1][1] for n, rate in zip(target.agents, truth, strict=True)
        ]
        alone.append((target.means[:, 0] - truth) ** 2)
        shrunken.append((means - truth) ** 2)
        said.append(found.real_rollouts_worth)
    return 1.0 - np.mean(shrunken) / np.mean(alone), np.mean(held), np.median(said)


def tests(rates, foretold, runs, rounds, seed):
    """How often an agent that is not better than every other is called the best, how often one is, and when."""
    rng, wrong, done, when = np.random.default_rng(seed), 0, 0, []
    rates = np.asarray(rates)
    for _ in range(max(1, runs // 50)):
        outcomes = (rng.random((50, len(rates), rounds)) < rates[:, None]).astype(float)
        least = wealth_of(outcomes, foretold).min(axis=-1) >= (len(rates) - 1) / 0.05
        called = least.any(axis=1)
        best = rates == rates.max() if (rates == rates.max()).sum() == 1 else np.zeros(len(rates), dtype=bool)
        wrong += int(called[:, ~best].any(axis=1).sum())
        if best.any():
            first = np.where(called[:, best], least[:, :, best].argmax(axis=1) + 1, rounds + 1)
            done += int(called[:, best].sum())
            when += first.ravel().tolist()
    return wrong / (50 * max(1, runs // 50)), done / (50 * max(1, runs // 50)), np.median(when) if when else np.nan


def plans(agents, real, bound, runs, seed):
    """The regret after the planned rollouts: how often it is above the bound, and how many it took an agent."""
    rng, above, before, took = np.random.default_rng(seed), 0, 0, []
    for _ in range(runs):
        truth = rng.random(agents)
        values = rolled(truth, real, rng)
        target = table(values)
        found = decide(compare(proxy=target, target=target, metrics=SUCCESS), ASKED, None, 1)
        made = np.full(agents, float(real))
        todo = plan(found, bound=bound, made=made, scale=1.0)
        sums = values.sum(axis=1)
        before += truth.max() - truth[(sums + 1).argmax()] > bound
        more = np.array([min(todo.rollouts.get(name, 0), 5000) for name in target.agents])
        sums += rng.binomial(more, truth)
        above += truth.max() - truth[((sums + 1) / (real + more + 2)).argmax()] > bound
        took.append(more.sum() / agents)
    return above / runs, before / runs, np.median(took), np.mean(took)


def main():
    """Print every table as it is done."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=2000)
    runs, started = parser.parse_args().runs, time.process_time()
    decision.DRAWS = DRAWS
    print(f"# Decisions of made-up evaluations, {runs} a setting\n\n{DRAWS} draws a decision, instead of 40 000.\n")
    print("## Truths from the stated prior (uniform), target alone\n")
    head = (
        "held: scores | held: regret | regret said | regret found | best said | best found | set holds best | set size"
    )
    print(f"| agents | rollouts | {head} |\n|{'---|' * 10}")
    for seed, (agents, rollouts) in enumerate((k, n) for k in AGENTS for n in ROLLOUTS):
        row = decisions(agents, rollouts, runs, seed)
        print(f"| {agents} | {rollouts} | " + " | ".join(f"{value:.4f}" for value in row) + " |", flush=True)
    print("\n## Fixed rates\n\n| rates | rollouts | held: scores | held: regret |\n|---|---|---|---|")
    fixed: list[tuple[float, ...]] = [(0.1, 0.3, 0.5, 0.7, 0.9), (0.85, 0.8, 0.75, 0.7)]
    fixed += [(0.98, 0.9, 0.9, 0.4, 0.1, 0.05, 0.02, 0.0), tuple(round(0.02 + 0.05 * place, 2) for place in range(20))]
    for seed, (rates, rollouts) in enumerate((r, n) for r in fixed for n in ROLLOUTS):
        row = decisions(len(rates), rollouts, runs, 100 + seed, rates)
        print(f"| {', '.join(map(str, rates))} | {rollouts} | {row[0]:.4f} | {row[1]:.4f} |", flush=True)
    decision.DRAWS = 40_000  # how unlikely an agent is to be the best decides here: fewer draws do not tell
    for seed, (agents, rollouts) in enumerate((k, n) for k in (2, *AGENTS) for n in ROLLOUTS):
        row = decisions(agents, rollouts, runs // 4, 150 + seed, (0.5,) * agents)
        print(f"| {agents} times 0.5, {runs // 4} runs | {rollouts} | {row[0]:.4f} | {row[1]:.4f} |", flush=True)
    decision.DRAWS = DRAWS
    print("\n## What is saved, starts paired (200 simulated)\n")
    print("| correlation | agents | real | saved | said | held |\n|---|---|---|---|---|---|")
    cases = [(c, k, n) for c in (0.0, 0.6, 0.8) for k in AGENTS for n in ROLLOUTS]
    for seed, (correlation, agents, real) in enumerate(cases):
        row = savings(correlation, agents, real, 200, runs, 200 + seed)
        cells = " | ".join(f"{value:.4f}" for value in row)
        print(f"| {correlation} | {agents} | {real} | {cells} |", flush=True)
    print("\n## What is saved, by the model over agents (200 simulated, unpaired), a quarter of the runs\n")
    print("| the proxy is off by | agents | real | saved | held | worth (median) |\n|---|---|---|---|---|---|")
    cases = [(s, k, n) for s in (0.0, 0.1, None) for k in AGENTS for n in ROLLOUTS]
    for seed, (spread, agents, real) in enumerate(cases):
        saved, held, worth = policies(spread, agents, real, 200, runs // 4, 300 + seed)
        told = "(useless)" if spread is None else spread
        print(f"| {told} | {agents} | {real} | {saved:.4f} | {held:.4f} | {worth:.1f} |", flush=True)
    print("\n## Test after each rollout, up to 500 of each agent\n")
    print("| rates | the proxy says | called wrongly | called rightly | median rounds |\n|---|---|---|---|---|")
    nulls = ([0.5, 0.5], [0.8, 0.8, 0.3, 0.3], [0.95] * 4, [0.5] * 8)
    powers = ([0.7, 0.5], [0.8, 0.6, 0.5, 0.4], [0.9, 0.6, 0.6, 0.6])
    cases = [(r, p) for r in nulls for p in (None, "wrong")]
    cases += [(r, p) for r in powers for p in (None, "right", "wrong")]
    for seed, (rates, says) in enumerate(cases):
        foretold = None if says is None else np.array(rates if says == "right" else rates[::-1]) * 0.9
        if says == "wrong" and rates in nulls:
            foretold = np.linspace(0.9, 0.1, len(rates))
        row = tests(rates, foretold, runs, 500, 400 + seed)
        print(f"| {rates} | {says} | {row[0]:.4f} | {row[1]:.3f} | {row[2]:.0f} |", flush=True)
    print("\n## After the planned rollouts, regret below 0.05 with 95 %\n")
    print("| agents | first | above before | above after | median more an agent | mean |\n|---|---|---|---|---|---|")
    for seed, (agents, real) in enumerate((k, n) for k in (4, 8) for n in (10, 25)):
        after, before, median, mean = plans(agents, real, 0.05, runs, 500 + seed)
        print(f"| {agents} | {real} | {before:.4f} | {after:.4f} | {median:.0f} | {mean:.0f} |", flush=True)
    print(f"\n{time.process_time() - started:.0f} s of one core.")


if __name__ == "__main__":
    main()
