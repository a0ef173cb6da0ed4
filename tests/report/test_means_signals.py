"""Whatever an effect may have along the axis of a figure can be drawn."""

import numpy as np
import pytest
from planted import TRUTH, planted_drives

from proxytune.effects import Panel
from proxytune.effects.effect import MOTIONS, SIGNALS
from proxytune.report.diagnosis.means import NAMES, Rates, _signal

DRIVES = planted_drives(TRUTH, episodes=1, seconds=10.0)


@pytest.mark.parametrize("signal", SIGNALS[1:])
def test_every_signal_of_a_panel_is_known_at_each_increment(signal):
    rates = Rates(dict.fromkeys(MOTIONS, np.ones(len(DRIVES.measured))), {})
    assert np.isfinite(_signal(DRIVES, rates, None, Panel(signal, "", "forward"))).sum() == len(DRIVES.measured)


def test_every_motion_of_a_panel_has_a_name():
    assert set(MOTIONS) == set(NAMES)
