"""Robots and studies are found beside the package."""

import pytest

from proxytune.errors import SettingsError
from proxytune.shipped import shipped


def test_robots_are_found():
    assert (shipped("robots") / "duckiebot" / "robot.toml").is_file()


def test_a_lost_folder_is_one_line():
    with pytest.raises(SettingsError, match="'unicorns' is missing; install proxytune again"):
        shipped("unicorns")
