"""How gymnasium comes to know of lane following, and what a user without gymnasium is told."""

import subprocess
import sys

import pytest

pytest.importorskip("gymnasium")


def printed(code):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    return done.stdout.strip(), done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    "code",
    [
        "import gymnasium; print(gymnasium.make('proxytune.environments:proxytune/LaneFollowing-v0').spec.id)",
        "import gymnasium, proxytune.environments; print(gymnasium.make('proxytune/LaneFollowing-v0').spec.id)",
    ],
)
def test_gymnasium_makes_it(code):
    assert printed(code)[0] == "proxytune/LaneFollowing-v0"


def test_without_gymnasium_it_says_what_to_install():
    _, errors = printed("import sys; sys.modules['gymnasium'] = None; import proxytune.environments")
    assert errors.splitlines()[-1].endswith('gymnasium is not installed; pip install "proxytune[gym]"')


def test_importing_proxytune_does_not_import_gymnasium():
    assert printed("import sys, proxytune; print('gymnasium' in sys.modules)")[0] == "False"
