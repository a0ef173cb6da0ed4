"""Installed from a wheel, outside the checkout, the command line works: robots and studies travel along."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def pip(*words):
    done = subprocess.run(
        [sys.executable, "-m", "pip", words[0], "--quiet", "--no-deps", *words[1:]],
        capture_output=True,
        text=True,
        check=False,
    )
    if "No matching distribution found for hatchling" in done.stderr:
        pytest.skip("no network: pip cannot fetch hatchling to build a wheel")
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The wheel's content, as pip would lay it into site-packages."""
    folder = tmp_path_factory.mktemp("wheel")
    pip("wheel", "--wheel-dir", folder, ROOT)
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def proxytune(site, *words, cwd):
    start = "from proxytune.__main__ import run; sys.exit(run())"
    command = [sys.executable, "-I", "-c", f"import sys; sys.path.insert(0, {str(site)!r}); {start}", *words]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, check=False)


@pytest.mark.slow
def test_robots_and_studies_are_in_the_wheel_and_databases_are_not(installed):
    names = {path.relative_to(installed).as_posix() for path in installed.rglob("*")}
    assert {"proxytune/robots/duckiebot/duckiebot.urdf", "proxytune/robots/maps/horseshoe.toml"} <= names
    assert "proxytune/py.typed" in names
    assert not [name for name in names if "benchmarks" in name or name.endswith("compare.md") or "truths" in name]
    assert {f"proxytune/skeletons/templates/{name}.txt" for name in ("body.urdf", "family.py", "study.toml")} <= names
    assert {"proxytune/report/templates/page.css", "proxytune/cli/commands.toml"} <= names
    for study in ("quickstart", "known_answer", "duckiebot"):
        assert {f"proxytune/studies/{study}/study.toml", f"proxytune/studies/{study}/target.csv"} <= names
    assert not [name for name in names if name.endswith((".db", ".lock", "report.html"))]


@pytest.mark.slow
def test_an_installed_proxytune_lists_its_robots_from_anywhere(installed, tmp_path):
    done = proxytune(installed, "list", "robots", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "duckiebot" in done.stdout


@pytest.mark.slow
def test_a_study_that_travels_along_is_copied_and_run(installed, tmp_path):
    shipped = installed / "proxytune" / "studies" / "quickstart" / "study.toml"
    text = shipped.read_text(encoding="utf-8")
    small = text.replace("budget = 24", "budget = 1\npreflight = false\nconfirm = 0")
    small = small.replace("seconds = 20.0", "seconds = 1.0")
    assert small != text
    shipped.write_text(small, encoding="utf-8")
    try:
        done = proxytune(installed, "study", "quickstart", "--json", cwd=tmp_path)
    finally:
        shipped.write_text(text, encoding="utf-8")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "quickstart" / "study.db").is_file()
    assert not (installed / "proxytune" / "studies" / "quickstart" / "study.db").exists()


@pytest.mark.slow
def test_an_editable_installation_is_the_checkout(tmp_path):
    pip("install", "--target", tmp_path, "--editable", ROOT)
    assert (tmp_path / "_proxytune.pth").read_text(encoding="utf-8").strip() == str(ROOT)
