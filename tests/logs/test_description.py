"""Everything that is wrong with a log.toml is said at once, in one line."""

import pytest

from proxytune.errors import LogError
from proxytune.logs.description import read_description
from proxytune.settings import read_settings

WRONG = """
command = "cmd_vel"
rate_hz = "fast"
baseline_m = -1
speed = 3

[camera]
frames = "no number.png"
"""


@pytest.fixture
def described(tmp_path):
    def read(text):
        path = tmp_path / "log.toml"
        path.write_text(text, encoding="utf-8")
        return read_description(read_settings(path))

    return read


def test_every_complaint_comes_at_once(described, tmp_path):
    with pytest.raises(LogError) as caught:
        described(WRONG)
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith(f"{tmp_path / 'log.toml'}: (1) ")
    wanted = ("command: unknown", "rate_hz: must be", "baseline_m: must be", "speed: unknown key", "robot: is missing")
    assert all(part in text for part in wanted), text
    assert "(6) camera.frames: must have the picture's number" in text


def test_a_single_complaint_has_no_number(described):
    with pytest.raises(LogError, match=r"log.toml: robot: is missing; add it$"):
        described('command = "twist"\nrate_hz = 10\n')


def test_without_a_rate_poses_have_times_of_their_own(described):
    assert described('robot = "r"\ncommand = "twist"\n').rate_hz == 0.0


def test_a_clock_offset_is_declared_or_fitted(described):
    text = 'robot = "r"\ncommand = "twist"\n'
    assert described(text).clock_offset_s is None
    assert described(text + "clock_offset_s = -0.25\n").clock_offset_s == -0.25
    fitted = described(text + 'clock_offset_s = "fit"\n')
    assert (fitted.clock_offset_s, fitted.fit_clock_offset) == (None, True)


@pytest.mark.parametrize("value", ['"later"', "true", "1e9", "[1]"])
def test_a_clock_offset_that_is_none_is_refused(described, value):
    with pytest.raises(LogError, match="clock_offset_s: must be"):
        described(f'robot = "r"\ncommand = "twist"\nclock_offset_s = {value}\n')
