"""The [teaching] table is read strictly."""

import pytest

from proxytune.errors import SettingsError
from proxytune.learning.settings import read_teaching
from proxytune.settings import Section

GOOD = {"target": "twin.toml", "target_samples": [0, 10, 20]}


def read(tmp_path, **changes):
    (tmp_path / "twin.toml").write_text("trim = 0.1\n")
    values = {key: value for key, value in {**GOOD, **changes}.items() if value is not None}
    return read_teaching(Section(tmp_path / "study.toml", "teaching.", values))


def test_without_the_table_nothing_is_taught(tmp_path):
    assert read_teaching(Section(tmp_path / "study.toml", "teaching.", {})) is None


def test_a_number_is_one_theta_and_a_pair_is_drawn_from(tmp_path):
    proxies = {"nominal": {}, "mixed": {"trim": 0.1, "delay": [0.0, 0.2]}}
    read_proxies = read(tmp_path, proxies=proxies).proxies
    assert dict(read_proxies["mixed"].bounds) == {"delay": (0.0, 0.2), "trim": (0.1, 0.1)}
    assert dict(read_proxies["nominal"].bounds) == {}


def test_nothing_is_rehearsed_unless_it_is_asked_for(tmp_path):
    assert read(tmp_path).rehearsal == 0.0
    assert read(tmp_path).later_keys == {}
    assert read(tmp_path, rehearsal=0.5).later_keys == {"rehearsal": 0.5}


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
        ({"target_samples": [0, True]}, "teaching.target_samples: must be a list of whole numbers"),
        ({"seeds": 0}, "teaching.seeds: must be between 1"),
        ({"tolerance": -1.0}, "teaching.tolerance: must be between 0"),
        ({"narrow": 1}, "teaching.narrow: must be true or false"),
        ({"width": {"trim": [-0.1, 0.1]}}, "teaching.width.trim: a width is at least 0"),
        ({"proxies": {"none": {}}}, "teaching.proxies.none: is what learning without a proxy is called"),
        ({"proxies": {"a": {"trim": "x"}}}, "teaching.proxies.a.trim: must be [low, high]"),
        ({"published": {"other": {}}}, "teaching.published.other: unknown key; known are: none"),
        ({"published": {"none": {"zero_shot": 0}}}, "teaching.published.none.samples: is missing"),
        ({"published": {"none": {"zero_shot": 0, "samples": 9, "reduction": 88}}}, "reduction: must be between"),
        ({"rehearsal": 1.0}, "teaching.rehearsal: must be between 0 and 0.99"),
        ({"rehearsal": -0.1}, "teaching.rehearsal: must be between 0 and 0.99"),
        ({"sedes": 3}, "teaching.sedes: unknown key; did you mean 'seeds'?"),
    ],
)
def test_every_mistake_is_one_line_with_its_key(tmp_path, changes, says):
    with pytest.raises(SettingsError) as told:
        read(tmp_path, **changes)
    assert str(told.value).startswith(f"{tmp_path / 'study.toml'}: ")
    assert says in str(told.value)
