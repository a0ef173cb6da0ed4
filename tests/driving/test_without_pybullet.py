"""On a Python that PyBullet has no wheels for, all but the bullet plant works, and that is refused in one line."""

import subprocess
import sys

import pytest
from processes import ENVIRONMENT

HIDDEN = """
import sys


class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "pybullet":
            raise ModuleNotFoundError("No module named 'pybullet'", name="pybullet")


sys.meta_path.insert(0, Hidden())
"""
STUDY = """format = 1
name = "small"
target = "target.csv"
metrics = ["distance:max"]
agents = ["steady", "daredevil", "smooth"]
starts = 1
budget = 3
initial = 3
engine = "sobol"
confirm = 0

[parameters]
trim = [-0.3, 0.3]

[domain]
seconds = 1.0
"""


def run(folder, code):
    """Run code where PyBullet cannot be found."""
    how = {"cwd": folder, "env": ENVIRONMENT, "capture_output": True, "text": True, "timeout": 300}
    return subprocess.run([sys.executable, "-c", HIDDEN + code], **how)


def command(folder, *words):
    return run(folder, f"from proxytune.cli.main import main; sys.exit(main({list(words)!r}))")


@pytest.fixture
def study(tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    (tmp_path / "target.csv").write_text("agent,episode,distance\nsteady,0,0.2\ndaredevil,0,0.5\nsmooth,0,0.3\n")
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("domain", "instead"),
    [("", 'plant = "planar"'), ('plant = "planar"\ncamera = "renderer"', 'camera = "ground_plane"')],
)
def test_what_needs_pybullet_is_refused_in_one_line_with_three_remedies(study, domain, instead):
    (study / "study.toml").write_text(STUDY + domain)
    done = command(study, "study", ".")
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    for remedy in (instead, "Python 3.11", "C++ compiler"):
        assert remedy in line
    assert "study.toml" in line


@pytest.mark.slow
def test_a_study_on_the_planar_plant_runs_without_pybullet(study):
    (study / "study.toml").write_text(STUDY + 'plant = "planar"')
    done = command(study, "study", ".")
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_every_public_name_can_be_had_without_pybullet(tmp_path):
    done = run(tmp_path, "import proxytune\nfor name in proxytune.__all__: getattr(proxytune, name)")
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_a_diagnosis_leaves_the_bullet_plant_out(tmp_path):
    code = """
from types import SimpleNamespace
from proxytune.diagnosis.motion.multistep_fit import has_body
print(has_body(SimpleNamespace(robot=SimpleNamespace(urdf="there"))))
"""
    assert run(tmp_path, code).stdout == "False\n"
