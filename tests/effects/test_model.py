"""model.toml is read strictly and written so that it reads back the same."""

import pytest
from one_line import complaint_of

from proxytune.effects import read_model
from proxytune.effects.model import effects_table

GOOD = """
format = 1
robot = "duckiebot"
[effects.trim]
trim = 0.05
[effects.driver_map]
offset = { value = 0.12, interval = [0.1, 0.14], unit = "duty" }
[effects.wheel_gain]
left = 0.9
"""


def write(folder, text):
    path = folder / "model.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_what_is_written_reads_back_by_its_names_in_theta(tmp_path):
    model = read_model(write(tmp_path, GOOD))
    assert model.theta == {"trim": 0.05, "driver_map": 0.12, "wheel_gain.left": 0.9}
    assert model.intervals == {"driver_map": (0.1, 0.14)}
    assert (model.robot, model.plant) == ("duckiebot", None)
    text = 'format = 1\nrobot = "duckiebot"\n' + effects_table(model.theta, model.intervals)
    assert read_model(write(tmp_path, text)) == model


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("[effects.trim]", "[effects.trimm]", "effects.trimm: no such effect; did you mean 'trim'?"),
        ("trim = 0.05", "trm = 0.05", "effects.trim.trm: unknown key; did you mean 'trim'?"),
        ("trim = 0.05", "trim = nan", "effects.trim.trim: must be finite"),
        ("trim = 0.05", "trim = 0.9", "effects.trim.trim: must be between -0.5 and 0.5"),
        ("trim = 0.05", 'trim = "x"', "effects.trim.trim: must be a number"),
        ("[0.1, 0.14]", "[0.14, 0.1]", "lower bound must be below"),
        ('"duty"', '"m"', "unit: must be 'duty'"),
        ("format = 1", "format = 2", "format: must be between 1 and 1"),
        ("format = 1", "format == 1", "is not valid TOML"),
        ('robot = "duckiebot"', "", "robot: is missing"),
    ],
)
def test_a_mistake_is_one_line_with_file_and_key(tmp_path, before, after, says):
    path = write(tmp_path, GOOD.replace(before, after))
    told = complaint_of(read_model, path)
    assert says in told
    assert str(path) in told
