import numpy as np

from proxytune.versions import version_changes, versions_of


def test_the_version_is_that_of_what_is_installed():
    assert versions_of(("numpy",)) == {"numpy": np.__version__}


def test_a_package_that_is_not_installed_has_an_unknown_version():
    assert versions_of(("no-such-package-at-all",)) == {"no-such-package-at-all": "unknown"}


def test_changes_are_told_in_the_name_that_people_use():
    before, after = {"pybullet": "3.2.5", "numpy": "2.0"}, {"pybullet": "3.2.6", "numpy": "2.0", "optuna": "4.0"}
    assert version_changes(before, after) == ["PyBullet 3.2.6 (was 3.2.5)", "Optuna 4.0 (was not used)"]
    assert version_changes(before, before) == []
