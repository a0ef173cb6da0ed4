"""A measure of one's own that fails as an objective is refused in one line, before any episode is run."""

import pytest

from proxytune.errors import SettingsError
from proxytune.study.study import open_study

WRONG = {
    "np.abs(proxy - target).mean(axis=-1)": r"gives values \(4, 3\) of means \(4, 3, 2\); give one for each table",
    "1 / 0": r"raised ZeroDivisionError: division by zero for means \(4, 3, 2\) against \(3, 2\); correct it",
    "'high'": "raised ValueError: could not convert string to float",
}


@pytest.mark.parametrize("formula", WRONG)
def test_what_it_does_wrong_is_told_with_file_and_key(make_study, formula):
    folder = make_study(objective='"mine:WRONG"')
    (folder / "mine.py").write_text(
        "import numpy as np\n\nfrom proxytune import Measure\n\n\n"
        f"def wrong(proxy, target, metrics):\n    return {formula}\n\n\n"
        'WRONG = Measure("wrong", "Wrong", "wrong", "lower", "", ".2f", on_means=wrong)\n'
    )
    with pytest.raises(SettingsError, match=f"study.toml: objective: measure 'mine:WRONG' {WRONG[formula]}") as told:
        open_study(folder)
    assert "\n" not in str(told.value)
