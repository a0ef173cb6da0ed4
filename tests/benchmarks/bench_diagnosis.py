"""What a diagnosis costs: `python -m pytest tests/benchmarks/bench_diagnosis.py -o addopts= -s`."""

import hidden
import pytest

from proxytune.diagnosis import increments
from proxytune.diagnosis.motion.clocks import split
from proxytune.diagnosis.motion.diagnose import diagnose
from proxytune.diagnosis.motion.drives import gather
from proxytune.diagnosis.motion.innovations import FIRST_GUESS, fit_noise, whitener
from proxytune.diagnosis.motion.selection import fit_declared, search
from proxytune.driving import read_robot

ROBOT = read_robot("duckiebot")
THETA = {"trim": 0.0, "delay": 0.15}


@pytest.fixture(scope="module")
def log():
    return hidden.make_log(hidden.IN_FORM[1])


@pytest.fixture(scope="module")
def drives(log):
    return gather(log, ROBOT, log.episodes)


def test_simulating_twelve_one_minute_logs(benchmark, drives):
    benchmark(lambda: increments(drives, THETA))


def test_factoring_and_whitening_them(benchmark, drives):
    errors = drives.measured - increments(drives, THETA)
    benchmark(lambda: whitener(drives, FIRST_GUESS).whiten(errors))


def test_fitting_their_noise(benchmark, drives):
    errors = drives.measured - increments(drives, THETA)
    benchmark.pedantic(lambda: fit_noise(drives, errors, FIRST_GUESS), rounds=3)


def test_searching_the_whole_catalogue(benchmark, log):
    parts = split(log, ROBOT, None)
    benchmark.pedantic(
        lambda: search(fit_declared(parts.fitted, THETA, ("trim", "delay")), 1, lambda line: None), rounds=1
    )


def test_the_whole_diagnosis_with_confirmation_on_bullet(benchmark, log):
    benchmark.pedantic(lambda: diagnose(log, ROBOT, ("trim", "delay")), rounds=1)
