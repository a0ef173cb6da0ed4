"""A log from DataFrames is the log of the same files, and its faults are told by row and column."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

sys.path.append(str(Path(__file__).parent.parent / "diagnosis"))

from planted import CALM, TRUTH, planted_log, write_log

from proxytune import InputError, log_of, read_log
from proxytune.errors import LogError

DESCRIPTION = {"robot": "duckiebot", "command": "duty", "rate_hz": 20}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    log = planted_log(TRUTH, episodes=4, seconds=5.0, noise=CALM)
    return write_log(log, tmp_path_factory.mktemp("logs") / "planted")


@pytest.fixture(scope="module")
def samples(folder):
    return pd.read_csv(folder / "samples.csv", dtype={"episode": str})


def same(one, other):
    """Whether two logs hold the same."""
    described = [(log.name, log.robot, log.command, log.rate_hz, len(log.episodes)) for log in (one, other)]
    return described[0] == described[1] and all(
        np.array_equal(getattr(a, field), getattr(b, field), equal_nan=True)
        for a, b in zip(one.episodes, other.episodes, strict=True)
        for field in ("times", "commands", "poses")
    )


def test_a_log_of_dataframes_is_the_log_of_the_files(folder, samples):
    assert same(log_of(samples, {**DESCRIPTION, "name": "planted"}), read_log(str(folder)))


def test_a_log_without_a_name_has_one(samples):
    assert log_of(samples, DESCRIPTION).name == "log"


def test_episode_and_time_may_be_the_index_and_numbers_may_be_numpy_s(samples):
    description = {**DESCRIPTION, "rate_hz": np.int64(20)}
    assert same(log_of(samples.set_index(["episode", "time"]), description), log_of(samples, DESCRIPTION))


def test_commands_may_have_times_of_their_own(samples):
    poses, commands = samples.drop(columns=["left", "right"]), samples[["episode", "time", "left", "right"]]
    log = log_of(poses, DESCRIPTION, commands.assign(time=commands.time + 0.01))
    assert np.allclose(log.episodes[0].issued, log.episodes[0].times + 0.01)


def spoilt(row, column, value):
    def spoil(samples):
        frame = samples.astype({column: object})
        frame.loc[row, column] = value
        return frame

    return spoil


WRONG = {
    "a word": (spoilt(7, "x", "far"), {}, "samples: row 7, column 'x': must be a finite number, or empty .* got 'far'"),
    "a duty": (spoilt(0, "left", 50.0), {}, "samples: row 0, column 'left': a duty must be between -1 and 1, got 50"),
    "time": (spoilt(3, "time", 0.0), {}, "samples: row 3, column 'time': 0 s does not come after 0.1 s"),
    "a column more": (lambda samples: samples.assign(z=0), {}, "samples: unknown column 'z'"),
    "a column less": (lambda samples: samples.drop(columns="y"), {}, "samples: no column 'y'"),
    "no rows": (lambda samples: samples.head(0), {}, "samples: has no rows; add one per sample"),
    "no table": (lambda samples: [1, 2], {}, "samples: must be a DataFrame, got list"),
    "no text": (lambda samples: samples, {"name": None}, "log.toml: .*; give texts and numbers"),
    "a key": (lambda samples: samples, {"rate": 20}, "log.toml: rate: unknown key; did you mean 'rate_hz'"),
    "a command": (lambda samples: samples, {"command": "duties"}, "log.toml: command: unknown value 'duties'"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_no_log_is_one_line_with_row_and_column(samples, name):
    spoil, keys, words = WRONG[name]
    with pytest.raises(InputError, match=f"^{words}") as problem:
        log_of(spoil(samples), {**DESCRIPTION, **keys})
    assert "\n" not in str(problem.value)


def test_a_fault_of_the_commands_names_the_commands(samples):
    commands = samples[["episode", "time", "left", "right"]]
    with pytest.raises(LogError, match="^commands: row 5, column 'left': a duty must be"):
        log_of(samples.drop(columns=["left", "right"]), DESCRIPTION, spoilt(5, "left", 2.0)(commands))
    with pytest.raises(LogError, match="'03' is not in commands; add its commands"):
        log_of(samples.drop(columns=["left", "right"]), DESCRIPTION, commands[commands.episode != "03"])
