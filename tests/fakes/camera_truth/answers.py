"""What a diagnosis said of a blind set, beside its truth: one line of JSON a set."""

import json
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import proxytune
from camera_truth.cases import OUTSIDE
from camera_truth.sight import DECLARED
from camera_truth.writing import Truth, write_set

FLAGGED = ("partly explained", "unexplained")


@dataclass(frozen=True)
class Answer:
    """A set's truth and what was said.

    Attributes:
        truth: What is true of the set, as Truth has it.
        camera: `camera` of the diagnosis' document; empty where there is none.
        seconds: Processor time of the diagnosis [s].
        problem: What went wrong, empty as a rule.
    """

    truth: Mapping[str, Any]
    camera: Mapping[str, Any]
    seconds: float
    problem: str = ""

    @property
    def key(self) -> tuple[str, int]:
        """What tells a set from all others."""
        return self.truth["case"], self.truth["seed"]

    @property
    def missing(self) -> tuple[str, ...]:
        """Effects of the catalogue that the declared model lacks."""
        return tuple(one for one in self.truth["effects"] if one not in (*DECLARED, *OUTSIDE))

    @property
    def outside(self) -> bool:
        """Whether something is wrong that no catalogue has."""
        return bool(self.truth["outside"])

    @property
    def verdict(self) -> str:
        """The verdict on the camera."""
        return str(self.camera.get("verdict", "failed"))

    @property
    def named(self) -> tuple[tuple[str, ...], ...]:
        """Effects that were added, each with those that are said to be indistinguishable from it."""
        return tuple((one["name"], *one.get("indistinguishable_from", ())) for one in self.camera.get("effects", ()))

    @property
    def first_names(self) -> frozenset[str]:
        """The effects that were added, without rivals."""
        return frozenset(names[0] for names in self.named)

    @property
    def flagged(self) -> bool:
        """Whether it was said that something is left over, or a place in the picture pointed at."""
        return self.verdict in FLAGGED or bool(self.camera.get("blemishes"))

    @property
    def right(self) -> bool:
        """Whether every missing effect was named, or one that is said to be indistinguishable from it."""
        said = {name for names in self.named for name in names}
        return set(self.missing) <= said

    @property
    def surplus(self) -> tuple[str, ...]:
        """Effects that were added, of which neither they nor their rivals are missing."""
        return tuple(names[0] for names in self.named if not set(names) & set(self.missing))

    def intervals(self) -> dict[str, tuple[float, float, float]]:
        """Lower end, truth and upper end of every parameter of the extended model that is declared or missing."""
        known = (*DECLARED, *self.missing)
        told = {name: one for name, one in self.camera.get("extended", {}).items() if name.split(".")[0] in known}
        figures = self.truth["figures"]
        return {
            name: (one["interval"][0], figures[name], one["interval"][1])
            for name, one in told.items()
            if name in figures and None not in one["interval"] and (self.truth["scene"]["moves"] or name != "blur")
        }


def diagnosed(case: str, seed: int) -> Answer:
    """Draw a set into a folder that does not stay, and diagnose it."""
    with tempfile.TemporaryDirectory() as folder:
        truth: Truth = write_set(Path(folder), case, seed)
        began = time.process_time()
        try:
            camera = proxytune.diagnose(folder).document().get("camera") or {}
            problem = "" if camera else "nothing was said of the camera"
        except Exception as error:
            camera, problem = {}, f"{type(error).__name__}: {error}"
    return Answer(asdict(truth), camera, time.process_time() - began, problem)


def append(file: Path, answer: Answer) -> None:
    """Add an answer, on a line of its own even where the last one was cut off."""
    cut_off = file.exists() and file.stat().st_size > 0 and not file.read_bytes().endswith(b"\n")
    with file.open("a", encoding="utf-8") as lines:
        lines.write(("\n" if cut_off else "") + json.dumps(asdict(answer)) + "\n")


def read_answers(file: Path) -> list[Answer]:
    """All answers of a file, without a last one that was cut off."""
    answers = []
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
        try:
            answers.append(Answer(**json.loads(line)))
        except (ValueError, TypeError):
            continue
    return answers
