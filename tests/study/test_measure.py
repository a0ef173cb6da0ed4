import numpy as np
import pytest
from telling import Telling

from proxytune.errors import EpisodeError
from proxytune.running.progress import Silent
from proxytune.study.measure import measure
from proxytune.study.settings import read_study_settings
from proxytune.usefulness import noise_floor


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "model.toml"
    path.write_text("trim = 0.2\n")
    return path


def test_a_table_has_every_agent_start_and_metric_in_the_study_s_order(make_study, model):
    settings = read_study_settings(make_study(metrics='["distance:max"]'))
    table = measure(settings, model, 1001, Silent())
    assert table.agents == settings.agents
    assert table.episodes == ("0", "1", "2")
    assert table.metrics == ("distance", "survival_time")
    assert table.complete


def test_every_agent_is_told_of_once_it_is_measured(make_study, model):
    watcher = Telling()
    measure(read_study_settings(make_study(agents='["agent1", "agent0"]')), model, 1001, watcher)
    assert sorted(watcher.lines) == ["agent agent0 measured", "agent agent1 measured"]


def test_the_number_of_jobs_changes_nothing_and_the_seed_and_the_model_do(make_study, model):
    lingering = {"faults": '["agent0:0:lingers"]'}
    one, two = (read_study_settings(make_study(f"jobs{jobs}", jobs=jobs, domain=lingering)) for jobs in ("1", "2"))
    table = measure(one, model, 1001, Silent())
    same = measure(two, model, 1001, Silent())
    assert (same.agents, same.episodes) == (table.agents, table.episodes)
    assert (same.values == table.values).all()
    assert (measure(one, model, 1002, Silent()).values != table.values).all()
    model.write_text("trim = 0.1\n")
    assert (measure(one, model, 1001, Silent()).values != table.values).any()


def test_repeats_have_noise_of_their_own_and_the_first_is_what_one_alone_would_be(make_study, model):
    settings = read_study_settings(make_study())
    once, thrice = measure(settings, model, 1001, Silent()), measure(settings, model, 1001, Silent(), 3)
    assert thrice.episodes == ("0/0", "0/1", "0/2", "1/0", "1/1", "1/2", "2/0", "2/1", "2/2")
    assert thrice.complete
    assert (thrice.values[:, ::3] == once.values).all()
    for agent in thrice.values:
        assert len(np.unique(agent[:, 0])) == 9
    again = measure(settings, model, 1001, Silent(), 3)
    assert (again.values == thrice.values).all()


def test_a_target_of_repeats_has_a_floor_of_the_same_starts(make_study, model):
    settings = read_study_settings(make_study())
    once, twice = (measure(settings, model, 1001, Silent(), repeats) for repeats in (1, 2))
    assert noise_floor(target=twice, metrics=settings.metrics).kind == "same starts"
    assert noise_floor(target=once, metrics=settings.metrics).kind == "halves"


def test_the_study_needs_no_target_yet(make_study, model):
    folder = make_study()
    (folder / "target.csv").unlink()
    assert measure(read_study_settings(folder), model, 1, Silent()).complete


def test_a_failing_episode_leaves_no_table(make_study, model):
    settings = read_study_settings(make_study(domain={"faults": '["agent3:1:raises"]'}))
    with pytest.raises(EpisodeError, match="agent 'agent3' failed from start 1"):
        measure(settings, model, 1, Silent())
