"""Engines that are only compared keep what engines promise, where their library is installed."""

import pytest
from compared_engines import NAMES, PEERS, engine_of, why_not
from steps import search, steps

from proxytune.errors import InputError
from proxytune.search import ENGINE_NAMES as STUDY_ENGINES, engine_code, make_proposer
from proxytune.testing import check_engine

pytestmark = pytest.mark.slow
HERE = [
    pytest.param(engine, id=engine.name, marks=pytest.mark.skipif(bool(why), reason=f"{why} "))
    for engine in PEERS
    for why in [why_not(engine.name, composed=False)]
]


@pytest.mark.parametrize("engine", HERE)
def test_a_peer_keeps_what_engines_promise(engine):
    check_engine(engine)


@pytest.mark.parametrize("engine", HERE)
def test_a_peer_learns_from_the_scores_and_says_nothing(engine, capfd):
    low, high = (search(make_proposer(engine, 4), 10, 1, score) for score in (steps, lambda v: -steps(v)))
    assert sum(steps(trial.values) for trial in low[4:]) < sum(steps(trial.values) for trial in high[4:])
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("engine", [one for one in HERE if one.id != "skopt"])
def test_a_peer_leaves_the_threads_and_the_random_numbers_of_pytorch_as_they_were(engine):
    import torch

    before = torch.get_num_threads(), torch.random.get_rng_state()
    search(make_proposer(engine, 3), 4, 1)
    assert torch.get_num_threads() == before[0]
    if engine.name == "qlognei":
        assert torch.equal(torch.random.get_rng_state(), before[1])


def test_no_study_may_name_a_peer_and_each_is_found_by_its_name_and_digested():
    names = [engine.name for engine in PEERS]
    assert not set(names) & set(STUDY_ENGINES)
    assert [engine_of(name) for name in names] == list(PEERS)
    assert not any(engine.in_studies for engine in PEERS)
    assert all(engine_code(engine) != engine_code("gp") for engine in PEERS)
    assert set(NAMES) == {*names, *STUDY_ENGINES}
    with pytest.raises(InputError, match="unknown engine 'skop'"):
        engine_of("skop")
