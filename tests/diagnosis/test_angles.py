"""Cosine and sine from the tangent of half the angle are those of numpy."""

import numpy as np
import pytest

from proxytune.diagnosis.measured.angles import cosine_and_sine


@pytest.mark.parametrize("reach", [1e-9, 1.0, 100.0])
def test_they_are_those_of_numpy_for_any_angle(reach):
    angle = np.random.default_rng(1).uniform(-reach, reach, (7, 500))
    np.testing.assert_allclose(cosine_and_sine(angle), (np.cos(angle), np.sin(angle)), rtol=0.0, atol=1e-14)


def test_right_angles_are_right():
    quarter = np.arange(-6, 7) * np.pi / 2.0
    cosine, sine = cosine_and_sine(quarter)
    np.testing.assert_allclose(cosine + 1j * sine, 1j ** np.arange(-6, 7), rtol=0.0, atol=1e-14)


def test_of_zero_they_are_exact():
    assert [part.item() for part in cosine_and_sine(np.zeros(()))] == [1.0, 0.0]
