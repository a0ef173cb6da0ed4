import pytest

from proxytune.errors import EpisodeError
from proxytune.study.measure import measure
from proxytune.study.progress import Silent
from proxytune.study.settings import read_study_settings


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


def test_the_study_needs_no_target_yet(make_study, model):
    folder = make_study()
    (folder / "target.csv").unlink()
    assert measure(read_study_settings(folder), model, 1, Silent()).complete


def test_a_failing_episode_leaves_no_table(make_study, model):
    settings = read_study_settings(make_study(domain={"faults": '["agent3:1:raises"]'}))
    with pytest.raises(EpisodeError, match="agent 'agent3' failed from start 1"):
        measure(settings, model, 1, Silent())
