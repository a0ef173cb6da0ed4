"""Values known beforehand are used; beyond them the rates go on."""

import numpy as np

from proxytune.effects import Setting
from proxytune.effects.known import beforehand, values_along


def test_beyond_what_is_known_the_rates_lead_on_in_chunks_as_in_one():
    setting = Setting(2.0, np.zeros(3), {})
    known = beforehand(np.array([1.0, 5.0]), setting)
    whole, _ = values_along(np.full(4, 2.0), known)
    np.testing.assert_allclose(whole, [1.0, 5.0, 6.0, 7.0])
    first, later = values_along(np.full(3, 2.0), known)
    np.testing.assert_allclose(np.concatenate((first, values_along(np.full(1, 2.0), later)[0])), whole)


def test_every_member_of_a_batch_has_the_values_unless_it_has_its_own():
    shared = beforehand(np.array([1.0]), Setting(2.0, np.zeros((3, 2)), {}))
    assert shared.values.shape == (3, 1)
