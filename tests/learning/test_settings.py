"""The [teaching] table is read strictly."""

import numpy as np
import pytest
from one_line import complaint_of

from proxytune.learning import Costs, read_teaching
from proxytune.settings import Section

GOOD = {"target": "twin.toml", "target_samples": [0, 10, 20]}


def read(tmp_path, **changes):
    (tmp_path / "twin.toml").write_text("trim = 0.1\n")
    values = {key: value for key, value in {**GOOD, **changes}.items() if value is not None}
    return read_teaching(Section(tmp_path / "study.toml", "teaching.", values))


def test_without_a_word_nothing_is_taught_a_number_is_one_theta_and_a_pair_is_drawn_from(tmp_path):
    assert read_teaching(Section(tmp_path / "study.toml", "teaching.", {})) is None
    assert read(tmp_path).rehearsal == 0.0
    assert read(tmp_path).later_keys == {}
    assert read(tmp_path, rehearsal=0.5).later_keys == {"rehearsal": 0.5}
    plain, other = read(tmp_path), read(tmp_path, proxy_lessons="learner", costs={"label": 2})
    assert (plain.proxy_lessons, plain.target_lessons, plain.costs) == ("expert", "expert", Costs(1.0, 1.0, 0.0))
    assert (other.later_keys, other.costs) == ({"proxy_lessons": "learner"}, Costs(1.0, 1.0, 2.0))
    read_proxies = read(tmp_path, proxies={"nominal": {}, "mixed": {"trim": 0.1, "delay": [0.0, 0.2]}}).proxies
    assert dict(read_proxies["mixed"].bounds) == {"delay": (0.0, 0.2), "trim": (0.1, 0.1)}
    assert dict(read_proxies["nominal"].bounds) == {}


@pytest.mark.parametrize("with_proxy", [False, True])
def test_where_the_expert_drives_all_target_samples_are_off_policy(tmp_path, with_proxy):
    told = read(tmp_path, costs={"off_policy": 2, "on_policy": 5, "label": 1})
    counts = {"without": 0.0, "needed": 30.0} if with_proxy else {"without": 30.0, "needed": 0.0}
    assert abs(told.cost_saved(**counts)) == 90.0


def test_where_the_learner_drives_the_first_round_is_the_experts_and_costs_have_any_shape(tmp_path):
    told = read(tmp_path, target_lessons="learner", costs={"off_policy": 2, "on_policy": 5, "label": 1})
    counts = np.array([0.0, 4.5, 10.0, 11.0, 40.0])
    assert told.cost_saved(without=counts, needed=0.0).tolist() == [0.0, 13.5, 30.0, 36.0, 210.0]
    assert told.cost_saved(without=0.0, needed=counts).tolist() == [0.0, -27.0, -60.0, -66.0, -240.0]
    saved = told.cost_saved(without=np.array([0.0, 7.0, 500.0]), needed=np.array([[0.0], [12.0]]))
    assert saved.tolist() == [[0.0, 21.0, 2970.0], [-72.0, -51.0, 2898.0]]
    assert read(tmp_path).cost_saved(without=400.0, needed=100.0) == 300.0


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"target": None}, "teaching.target: is missing; add it"),
        ({"target": "no.toml"}, "teaching.target: no such file"),
        ({"target_samples": None}, "teaching.target_samples: is missing; give numbers"),
        ({"target_samples": [10, 20]}, "teaching.target_samples: must begin with 0"),
        ({"target_samples": [0]}, "teaching.target_samples: must rise, over two numbers"),
        ({"target_samples": [0, 20, 10]}, "teaching.target_samples: must rise"),
        ({"target_samples": [0, 1.5]}, "teaching.target_samples: must be a list of whole numbers"),
        ({"seeds": 0}, "teaching.seeds: must be between 1"),
        ({"tolerance": -1.0}, "teaching.tolerance: must be between 0"),
        ({"narrow": 1}, "teaching.narrow: must be true or false"),
        ({"width": {"trim": [-0.1, 0.1]}}, "teaching.width.trim: a width is at least 0"),
        ({"width": {"trim": [float("nan"), 0.1]}}, "teaching.width.trim: bounds must be finite"),
        ({"width": {"trim": [0.2, 0.1]}}, "teaching.width.trim: the lower bound must be below the upper one"),
        ({"width": {"trim": 0.1}}, "teaching.width.trim: must be [low, high]"),
        ({"examinations": 7}, "teaching.examinations: must be between 8"),
        ({"examinations": 20.0}, "teaching.examinations: must be a whole number"),
        ({"proxies": {"none": {}}}, "teaching.proxies.none: is what learning without a proxy is called"),
        ({"proxies": {"a": {"trim": "x"}}}, "teaching.proxies.a.trim: must be [low, high]"),
        ({"published": {"other": {}}}, "teaching.published.other: unknown key; known are: none"),
        ({"published": {"none": {"zero_shot": 0}}}, "teaching.published.none.samples: is missing"),
        ({"published": {"none": {"zero_shot": 0, "samples": 9, "reduction": 88}}}, "reduction: must be between"),
        ({"rehearsal": 1.0}, "teaching.rehearsal: must be between 0 and 0.99"),
        ({"rehearsal": float("nan")}, "teaching.rehearsal: must be finite"),
        ({"target_lessons": "nobody"}, "teaching.target_lessons: unknown value 'nobody'; known are: expert, learner"),
        ({"proxy_lessons": "lerner"}, "teaching.proxy_lessons: unknown value 'lerner'; did you mean 'learner'?"),
        ({"costs": {"label": -1}}, "teaching.costs.label: must be between 0 and inf, got -1"),
        ({"costs": {"off_policy": float("inf")}}, "teaching.costs.off_policy: must be finite"),
        ({"costs": 2.0}, "teaching.costs: must be a table"),
        ({"costs": {"label": "much"}}, "teaching.costs.label: must be a number"),
        ({"costs": {"labels": 1}}, "teaching.costs.labels: unknown key; did you mean 'label'?"),
        ({"sedes": 3}, "teaching.sedes: unknown key; did you mean 'seeds'?"),
    ],
)
def test_every_mistake_is_one_line_with_its_key(tmp_path, changes, says):
    told = complaint_of(lambda: read(tmp_path, **changes))
    assert told.startswith(f"{tmp_path / 'study.toml'}: ")
    assert says in told
