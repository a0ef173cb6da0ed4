"""How often the diagnosis of a camera is right, on frames that another renderer drew of lanes laid by hand."""

import sys
from pathlib import Path

import pytest
from joblib import Parallel, delayed

sys.path.append(str(Path(__file__).resolve().parents[2] / "fakes"))

from camera_truth.answers import diagnosed
from camera_truth.rates import confusion, coverage, rates

SETS = (
    ("none still small_loop", 500),
    ("none drive horseshoe 20mm_tape", 501),
    ("camera_roll", 502),
    ("lens_distortion 20mm_tape", 503),
    ("camera_latency", 504),
    ("vignetting", 505),
    ("camera_height+field_of_view", 506),
    ("dirt", 507),
    ("bumper", 508),
    ("bent_lens", 509),
)
"""Sets whose seeds nothing was developed on: half a minute of processor time each."""


@pytest.mark.slow
def test_what_a_camera_lacks_is_named_and_what_no_name_explains_is_flagged(capsys):
    answers = Parallel(n_jobs=2)(delayed(diagnosed)(case, seed) for case, seed in SETS)
    counted = rates(answers)
    held = coverage(answers)
    with capsys.disabled():
        print()
        print("\n".join(f"{name}: {rate}" for name, rate in counted.items()))
        print("\n".join(f"{name}: {rate}" for name, rate in held.items()))
        print(confusion(answers))
    assert counted["failed"].hits == 0
    assert counted["geometric: named"].hits == counted["geometric: named"].of == 2
    assert counted["timed: named"].hits == 1
    assert counted["light: named"].hits == 1
    assert counted["pairs: both named"].hits == 1
    assert counted["nothing missing: false alarms"].hits == 0
    assert counted["outside: flagged"].hits >= 2
    assert sum(rate.hits for rate in held.values()) >= 0.8 * sum(rate.of for rate in held.values())
