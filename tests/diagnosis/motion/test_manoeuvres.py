"""The library of manoeuvres: what `record` drives, and where the design of a drive begins."""

import numpy as np
import pytest

from proxytune.diagnosis.motion.manoeuvres import LIBRARY, commands_of
from proxytune.driving import read_robot

TIMES = np.arange(1200) / 20.0


@pytest.mark.parametrize(("name", "text", "shape"), LIBRARY, ids=[name for name, _, _ in LIBRARY])
def test_every_manoeuvre_is_described_and_stays_within_full_duty(name, text, shape):
    duties = shape(TIMES)
    assert duties.shape == (1200, 2)
    assert np.abs(duties).max() <= 1.0
    assert np.ptp(duties) > 0.1
    assert len(text) > 20


def test_a_car_rolls_where_it_cannot_turn_on_the_spot():
    commands = commands_of({name: shape for name, _, shape in LIBRARY}["spins"], TIMES, read_robot("car"))
    assert set(commands[:, 0]) == {0.4}
    assert np.ptp(commands[:, 1]) == 2.0
