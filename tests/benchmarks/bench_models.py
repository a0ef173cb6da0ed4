"""Which model predicts PRPV better: of the score or of the metrics? `python tests/benchmarks/bench_models.py STUDY`.

Every trial of a finished study is held out in turn and predicted from the others; nothing is simulated.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from proxytune.search import fit_surrogate, unit_array
from proxytune.search.likelihood import fit_outputs
from proxytune.search.outcomes import composed_scores
from proxytune.storage import Store
from proxytune.study import StudyRun, goal_of, open_study
from proxytune.study.run import as_stored


def main():
    opened = open_study(Path(sys.argv[1]))
    with Store.read(opened.settings.folder) as store:
        study = as_stored(opened, store)
        trials = [StudyRun(study, store).search_trial(trial) for trial in store.trials() if trial.prpv is not None]
        goal = goal_of(StudyRun(study, store))
    space = study.settings.space
    unit = unit_array(space, [trial.values for trial in trials])
    actual = np.array([trial.score for trial in trials])
    predicted = {"constant": [], "of the score": [], "of the metrics": []}
    for place in range(len(trials)):
        rest = np.arange(len(trials)) != place
        others = [trial for kept, trial in zip(rest, trials, strict=True) if kept]
        surrogate = fit_surrogate(space, others)
        predicted["constant"].append(actual[rest].mean())
        predicted["of the score"].append(surrogate.mean(unit[[place]])[0])
        predicted["of the metrics"].append(composed_scores(fit_outputs(space, others), goal, 1)(unit[[place]]).mean())
    print(f"{len(trials)} held-out trials of {study.settings.name}")
    for name, found in predicted.items():
        error = np.array(found) - actual
        order = "" if name == "constant" else f", rank correlation {spearmanr(found, actual).statistic:.2f}"
        print(f"model {name:15} error {np.sqrt(np.mean(error**2)):.1f}, of which bias {error.mean():+.1f}{order}")


if __name__ == "__main__":
    main()
