"""What `import proxytune` offers: named, typed, documented, and loaded only when it is used."""

import fnmatch
import inspect
import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import proxytune

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
NAMES = [name for name in proxytune.__all__ if name != "__version__"]
HEAVY = {"numpy", "pandas", "matplotlib", "pybullet", "scipy", "sklearn", "skopt", "torch"}


def loaded(code):
    """Which heavy libraries a fresh Python has loaded after this code."""
    ask = f"import json, sys; print(json.dumps(sorted({HEAVY!r} & set(sys.modules))))"
    done = subprocess.run([sys.executable, "-c", f"{code}\n{ask}"], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stdout.splitlines()[-1]))


def test_names_are_sorted_and_listed_and_the_package_is_typed_and_of_the_version_of_the_project():
    assert proxytune.__all__ == sorted(proxytune.__all__)
    assert dir(proxytune) == proxytune.__all__
    with pytest.raises(AttributeError, match=r"no attribute 'run_studdy'; did you mean 'run_study'\?"):
        _ = proxytune.run_studdy
    assert not hasattr(proxytune, "nothing_like_it")
    assert (ROOT / "proxytune" / "py.typed").is_file()
    included = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["include"]
    assert any(fnmatch.fnmatch("/proxytune/py.typed", f"{pattern}*") for pattern in included)
    assert proxytune.__version__ == PROJECT["project"]["version"]


@pytest.mark.parametrize("name", NAMES)
def test_every_name_is_there_under_its_own_name_and_documented(name):
    thing = getattr(proxytune, name)
    assert thing.__name__ == name
    doc = inspect.getdoc(thing)
    assert doc
    assert not doc.startswith(f"{name}("), "a dataclass without a docstring gets its signature"
    assert name in proxytune.__doc__


@pytest.mark.parametrize("name", [name for name in NAMES if inspect.isfunction(getattr(proxytune, name))])
def test_every_function_is_typed_and_says_what_it_raises(name):
    function = getattr(proxytune, name)
    signature = inspect.signature(function)
    assert signature.return_annotation is not inspect.Signature.empty
    assert all(one.annotation is not inspect.Parameter.empty for one in signature.parameters.values())
    doc = inspect.getdoc(function)
    assert "Args:" in doc
    assert all(f"{parameter}:" in doc for parameter in signature.parameters)
    assert "Raises:" in doc


@pytest.mark.parametrize("name", proxytune.__all__)
def test_every_name_is_on_the_page_about_python(name):
    assert f"`{name}`" in (ROOT / "docs" / "how-to" / "python.md").read_text(encoding="utf-8")


def test_loading_the_package_or_the_help_loads_no_library():
    assert loaded("import proxytune") == set()
    assert loaded("from proxytune import InputError") == set()
    code = (
        "import runpy, sys; sys.argv = ['proxytune', '--help']\ntry: runpy.run_module('proxytune', run_name='__main__')"
    )
    assert loaded(f"{code}\nexcept SystemExit: pass") == set()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["score", "log_of", "SearchBox", "run_study", "read_study"])
def test_a_name_that_simulates_nothing_by_itself_loads_no_simulator(name):
    assert "pybullet" not in loaded(f"from proxytune import {name}")
