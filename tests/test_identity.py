import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from proxytune.identity import files_beside, meaning_of, modules_beside, version_changes, versions_of

PLAIN = 'A = 1\n\nclass B:\n    c: int = 2\n\n    def d(self, e=None):\n        return f"{e}" if e else self.c\n'
SAME = {
    "comments": PLAIN.replace("\n\n", "\n# a comment\n\n"),
    "layout": PLAIN.replace("e=None", "e  =  None,").replace("    ", "  "),
    "quotes": PLAIN.replace('f"{e}"', "f'{e}'"),
    "a module's docstring": f'"""What it is."""\n{PLAIN}',
    "an attribute's": PLAIN.replace("A = 1\n", 'A = 1\n"""The first letter."""\n'),
    "a class's": PLAIN.replace("class B:\n", 'class B:\n    """The second."""\n'),
    "a function's": PLAIN.replace("None):\n", 'None):\n        """The third."""\n'),
    "ends of lines": PLAIN.replace("\n", "\r\n"),
}
OTHER = {
    "a number": PLAIN.replace("A = 1", "A = 2"),
    "a kind of number": PLAIN.replace("A = 1", "A = 1.0"),
    "a name": PLAIN.replace("A = 1", "a = 1"),
    "a default": PLAIN.replace("e=None", "e=0"),
    "a string that is used": PLAIN.replace("A = 1", 'A = "1"'),
    "a line less": PLAIN.replace("A = 1", ""),
    "nothing returned": PLAIN.replace('return f"{e}" if e else self.c', "return"),
    "None for True": PLAIN.replace("e=None", "e=True"),
    "no Python at all": PLAIN.replace("class B:", "class B"),
}


def meaning(folder, **files):
    paths = []
    for name, text in files.items():
        paths.append(folder / name.replace("__", ".").replace("_in_", "/"))
        paths[-1].parent.mkdir(exist_ok=True)
        paths[-1].write_bytes(text if isinstance(text, bytes) else text.encode())
    return meaning_of(paths, folder)


@pytest.mark.parametrize("what", SAME)
def test_what_is_written_for_readers_changes_no_meaning(tmp_path, what):
    assert meaning(tmp_path, a__py=SAME[what]) == meaning(tmp_path, a__py=PLAIN)


@pytest.mark.parametrize("what", OTHER)
def test_what_is_run_changes_the_meaning(tmp_path, what):
    assert meaning(tmp_path, a__py=OTHER[what]) != meaning(tmp_path, a__py=PLAIN)


@settings(max_examples=50)
@given(st.integers() | st.floats(allow_nan=False) | st.text() | st.booleans() | st.none() | st.binary())
def test_brackets_around_a_constant_mean_nothing_and_a_list_of_it_something_else(tmp_path_factory, value):
    folder = tmp_path_factory.mktemp("constants")
    one = meaning(folder, a__py=f"x = {value!r}\n")
    assert one != meaning(folder, a__py=f"x = [{value!r}]\n")
    assert one == meaning(folder, a__py=f"x = ({value!r})\n")


@pytest.mark.parametrize("text", ["def (", "x = '\0'", b"\xff\xfe", "(" * 2000 + ")" * 2000])
def test_a_module_that_cannot_be_parsed_counts_by_its_bytes(tmp_path, text):
    one = meaning(tmp_path, a__py=text)
    assert one == meaning(tmp_path, a__py=text)
    assert one != meaning(tmp_path, a__py=(text if isinstance(text, bytes) else text.encode()) + b"\n# more")


def test_comments_of_toml_do_not_count_its_values_do_and_other_files_by_bytes_and_names(tmp_path):
    one = meaning(tmp_path, a__toml="[b]\nc = 1\nd = 2 # why\n")
    assert one == meaning(tmp_path, a__toml="b = { d = 2, c = 1 }\n")
    assert one != meaning(tmp_path, a__toml="b = { d = 2, c = 1.0 }\n")
    assert meaning(tmp_path, a__urdf="<robot/>") != meaning(tmp_path, a__urdf="<robot/> ")
    one = meaning(tmp_path, a__py="x = 1", b_in_c__py="y = 2")
    assert one == meaning(tmp_path, b_in_c__py="y = 2", a__py="x = 1")
    assert one != meaning(tmp_path, a__py="y = 2", b_in_c__py="x = 1")


def test_the_same_digest_was_found_on_another_day_and_an_escape_is_no_warning_here(tmp_path, recwarn):
    known = "ee21e0605f26a651f34c14d2402ce3607d7c9b3fd36a9b8ba723cddf9d18b9aa"
    assert meaning(tmp_path, a__py=PLAIN, b__toml="c = [1, 2.5]\n", d__txt="e") == known
    assert meaning(tmp_path, a__py='x = "\\d"\n') == meaning(tmp_path, a__py='x = "\\\\d"\n')
    assert not recwarn.list


def test_modules_are_those_of_the_folder_and_of_what_can_be_a_package_within(tmp_path):
    for name in ("a.py", "pack/b.py", "pack/deep/c.py", "weights/net.npz"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("x = 1\n")
    hidden = (".git/x.py", "__pycache__/x.py", "not-a-package/x.py", "other/study.toml", "other/x.py", ".hidden.py")
    for name in (*hidden, "environment/pyvenv.cfg", "environment/x.py", "found/next/play_commands.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("x = 1\n")
    (tmp_path / "gone.py").symlink_to("nowhere.py")
    (tmp_path / "pack" / "up").symlink_to(tmp_path)
    found = [path.relative_to(tmp_path).as_posix() for path in modules_beside(tmp_path)]
    assert found == ["a.py", "pack/b.py", "pack/deep/c.py"]
    assert tmp_path / "weights" / "net.npz" in files_beside(tmp_path)


def test_versions_are_those_of_what_is_installed_told_by_the_names_that_people_use():
    assert versions_of(("numpy",)) == {"numpy": np.__version__}
    assert versions_of(("no-such-package-at-all",)) == {"no-such-package-at-all": "unknown"}
    before, after = {"pybullet": "3.2.5", "numpy": "2.0"}, {"pybullet": "3.2.6", "numpy": "2.0", "optuna": "4.0"}
    assert version_changes(before, after) == ["PyBullet 3.2.6 (was 3.2.5)", "Optuna 4.0 (was not used)"]
    assert version_changes(before, before) == []
