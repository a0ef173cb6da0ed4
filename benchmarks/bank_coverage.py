"""A second target with a bank: how often does knowledge alone hold a hidden θ, and how small is its region?

    python benchmarks/bank_coverage.py [TRUTHS]

Each truth is drawn evenly over the box, and every agent driven there under seeds that the bank does not use. The bank's
trials alone tell θ; nothing of the proxy is simulated. Beside it what the first 24 trials of the bank's design tell.
"""

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from proxytune.files import shipped
from proxytune.running import run_together
from proxytune.search import from_unit, learn_theta
from proxytune.seeds import target_seed
from proxytune.storage import Store
from proxytune.study import (
    StudyRun,
    earlier_trials,
    goal_of,
    learn,
    open_bank,
    outputs_of,
    plan_episodes,
    read_study_settings,
    run_preflight,
)

BANK = "duckiebot_bank"
FEW = 24


def main(truths: int) -> None:
    """Print a line per truth, and the counts."""
    study = open_bank(read_study_settings(shipped("studies") / BANK))
    rows = []
    with tempfile.TemporaryDirectory() as folder, Store.open(Path(folder)) as store:
        settings = replace(study.settings, path=Path(folder) / "study.toml", learn_from=(BANK,))
        run = StudyRun(replace(study, settings=settings), store)
        run_preflight(run)
        learn(run)
        earlier, goal, space = earlier_trials(run), goal_of(run), settings.space
        for number in range(truths):
            truth = from_unit(space, np.random.default_rng(number).random(len(space.names)))
            outcomes = run_together(study.family, plan_episodes(settings, space.theta(truth), target_seed(number)))
            told = replace(goal, values=np.array(outputs_of(study, outcomes or ())))
            known, few = (learn_theta(space, trials, told, 1) for trials in (earlier, earlier[:FEW]))
            rows.append((known.holds(truth), known.posterior.share, few.holds(truth), few.posterior.share))
            print(number, *(f"{value:.4f}" for value in rows[-1]), f"misfit {known.misfit.p_value:.2f}", flush=True)
    held, share, held_few, share_few = np.array(rows, dtype=float).T
    print(
        f"{len(earlier)} trials: held {held.sum():.0f} of {truths}, region {np.median(share):.2%} of the box (median)"
    )
    print(f"{FEW} trials: held {held_few.sum():.0f} of {truths}, region {np.median(share_few):.2%}")


if __name__ == "__main__":
    if "--help" in sys.argv:
        print(__doc__)
        sys.exit()
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
