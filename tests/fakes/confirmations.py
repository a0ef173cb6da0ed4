"""A study's result whose knowledge of θ is what a test asks for."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from proxytune.search import Information
from proxytune.search.posterior import Misfit, posterior_of
from proxytune.study import Confirmation
from proxytune.study.answer import Finalist
from proxytune.usefulness.expectation import Estimate, Expectation, Expected

FITS, LACKS, UNTOLD = Misfit(1.0, 1.1, 0.4), Misfit(9.0, 1.1, 0.002), Misfit(1.0, None, None)
AGENTS = (("agent4", 0.46), ("agent0", 0.3), ("agent1", 0.2), ("agent2", 0.04))
TOLD = (
    Information("delay", AGENTS, (("speed", 1.0),), "starts"),
    Information("trim", (("agent1", 1.0),), (("distance", 0.75), ("survival_time", 0.25)), "trials"),
)


def normal(centre, deviation, correlation=0.0):
    """A log density over the unit cube, of a normal whose first two coordinates are correlated."""
    covariance = np.diag(np.square(deviation))
    covariance[0, 1] = covariance[1, 0] = correlation * deviation[0] * deviation[1]
    inverse = np.linalg.inv(covariance)
    return lambda points: -0.5 * np.einsum("ni,ij,nj->n", points - centre, inverse, points - centre)


def planted(result, centre=(0.4, 2.0 / 3.0), deviation=(0.05, 0.02), correlation=0.0, **known):
    """The result with θ known to be round a point of the unit cube, within its box."""
    log = normal(np.array(centre), np.array(deviation), correlation)
    learnt = replace(result.knowledge)
    found = {
        "likelihood": SimpleNamespace(log=log),
        "posterior": posterior_of(log, 2),
        "misfit": FITS,
        "information": TOLD,
        "as_good": (0.0625, {"delay": (0.03, 0.21), "trim": (0.05, 0.15)}),
        **known,
    }
    # They are cached properties, so what is in the dictionary is what they give.
    learnt.__dict__.update(found)
    return replace(result, knowledge=learnt)


def confirmed(result, score=12, ends=(8.0, 20.0), **floor):
    """The result, its answer confirmed by fresh episodes with this PRPV, interval and noise floor."""
    own = result.best.assessment
    inner = replace(own.prpv_interval, low=ends[0], high=ends[1])
    noise = replace(own.noise_floor, **floor)
    excess = Estimate(score - noise.value, ends[0] - noise.high, ends[1] - noise.low)
    prpv = Expected(Estimate(score, *ends), Estimate(noise.value, noise.low, noise.high), excess)
    expected = Expectation(prpv, None, 5, 2.0, noise)
    fresh = replace(own, prpv=replace(own.prpv, value=score), prpv_interval=inner, noise_floor=noise)
    # What else a candidate has is of no matter to a report.
    answer = Finalist(result.best.trial, fresh=((),) * 5, scores=(score,), assessment=fresh)
    return replace(result, confirmation=Confirmation(answer, (answer,), 18, expected, result.knowledge))
