"""An effect that is added beside the others is taken up everywhere, and refused where it is not documented."""

import json

import pytest
from project import copy_project, run

EFFECT = '''

@effect("weak_reverse", Stage.MOTION)
class WeakReverse(ShippedEffect):
    """The robot is slower backwards than forwards."""

    loss: float = parameter("", 0.0, 0.9, probes=(0.02, 0.05, 0.1, 0.2, 0.4, 0.8), source="made up")
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.DIRECTION,), shown=Means(Cue.DIRECTION, (Panel("forward", "forward speed [m/s]", "forward"),))
    )

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Slow down what is backwards."""
        forward = signal[..., :1]
        slowed = np.where(forward < 0.0, (1.0 - self.loss) * forward, forward)
        return np.concatenate((slowed, signal[..., 1:]), axis=-1), None
'''


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A copy of the project whose room of effects has one more class, and its name in the catalogue."""
    folder = copy_project(tmp_path_factory.mktemp("project"))
    motion = folder / "proxytune" / "effects" / "motion.py"
    motion.write_text(motion.read_text(encoding="utf-8") + EFFECT, encoding="utf-8")
    catalogue = folder / "proxytune" / "effects" / "catalogue.py"
    text = catalogue.read_text(encoding="utf-8")
    assert text.count("FloorSlope,") == 3  # imported, listed for two wheels, and listed for cars
    catalogue.write_text(text.replace("FloorSlope,", "WeakReverse, FloorSlope,", 2), encoding="utf-8")
    return folder


@pytest.mark.slow
def test_an_effect_that_is_added_in_one_place_is_listed_and_looked_for(folder):
    """tests/test_extending.py has one found, fitted and drawn."""
    rows = json.loads(run(folder, "-m", "proxytune", "list", "effects", "--json").stdout)["effects"]
    (row,) = [row for row in rows if row["effect"] == "weak_reverse"]
    assert (row["parameter"], row["stage"], row["source"]) == ("weak_reverse", "motion", "made up")
    tried = run(folder, "-c", "import proxytune.diagnosis; print(proxytune.diagnosis.MOTION_EFFECTS)").stdout
    assert "'weak_reverse'" in tried


@pytest.mark.slow
def test_an_effect_without_a_row_in_the_documents_is_refused_in_words(folder):
    command = ["-m", "pytest", "-n", "0", "tests/test_documents.py", "-k"]
    answer = run(folder, *command, "every_effect_and_its_parameters and weak_reverse")
    assert answer.returncode == 1
    assert "docs/reference/effects.md has no row for the effect 'weak_reverse'" in answer.stdout
