"""PRPV of a learning experiment's proxies: an interval for each, and θ drawn for each start where a proxy draws it."""

from types import MappingProxyType

import numpy as np
from taught import make_taught

from proxytune.learning.lessons import Distribution
from proxytune.storage.store import Store
from proxytune.study.provenance import adopt
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun
from proxytune.teaching.predictivity import predictivity

TRUE = Distribution(MappingProxyType({"delay": (0.21, 0.21), "trim": (0.12, 0.12)}))
WIDE = Distribution(MappingProxyType({"trim": (-0.3, 0.3)}))


def found(make_study):
    study = open_study(make_taught(make_study))
    with Store.open(study.settings.folder) as store:
        adopt(study, store)
        run = StudyRun(study, store)
        return study, predictivity(run, {"true": TRUE, "wide": WIDE}), run


def test_each_proxy_has_a_prpv_with_an_interval_that_holds_it_and_the_right_one_predicts_better_than_chance(make_study):
    _, each, _ = found(make_study)
    for one in each.values():
        assert one.interval[0] <= one.prpv <= one.interval[1]
        assert one.resampled.shape == (2000,)
    assert each["true"].prpv < each["true"].chance.mean
    assert not each["true"].chance.explains


def test_a_proxy_that_draws_theta_draws_it_for_every_start_the_same_for_all_agents(make_study):
    study = open_study(make_taught(make_study))
    with Store.open(study.settings.folder) as store:
        adopt(study, store)
        driven = []
        run = StudyRun(study, store)
        run.outcomes = lambda planned, what, plain=run.outcomes: driven.extend(planned) or plain(planned, what)
        predictivity(run, {"wide": WIDE})
    by_start = {start: {e.theta for e in driven if e.start == start} for start in range(study.settings.starts)}
    assert all(len(thetas) == 1 for thetas in by_start.values())
    assert len(set.union(*by_start.values())) == study.settings.starts
    trims = [dict(theta)["trim"] for theta in set.union(*by_start.values())]
    assert all(-0.3 <= trim <= 0.3 for trim in trims)
    assert np.std(trims) > 0.0
