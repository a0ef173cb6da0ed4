"""Several robots of one kind from Python: θ of each, and p(θ) over them; the command `fleet` is this and a terminal."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from proxytune import report
from proxytune.errors import InputError
from proxytune.study import Fleet, learn_fleet
from proxytune.usefulness import Estimate

UNKNOWN = Estimate(np.nan, np.nan, np.nan)


@dataclass(frozen=True, repr=False)
class FleetReport(report.Shown):
    """Several robots of one kind.

    Attributes:
        result: All of it.
    """

    result: Fleet

    def __repr__(self) -> str:
        return f"FleetReport of {len(self.result.robots)} robots by '{self.result.settings.name}': {self.sentence}"

    @property
    def sentence(self) -> str:
        """Say in which parameters the robots differ, and by how much."""
        return report.fleet_sentence(self.result)

    def view(self) -> report.View:
        """What the page shows."""
        return report.fleet_view(self.result, self.figures()["fleet"])

    def figures(self) -> dict[str, Figure]:
        """Each robot's intervals and the population, by name."""
        return {"fleet": report.fleet_figure(self.result)}

    def robots(self) -> pd.DataFrame:
        """One row per robot and parameter: the ends of 95 % by its own scores, and what it is given the fleet.

        The latter are NaN for a robot that no θ explains.
        """
        rows = []
        for robot in self.result.robots:
            given = self.result.given.get(robot.name, {})
            for name, (low, high) in robot.knowledge.intervals.items():
                own = {"robot": robot.name, "parameter": name, "fits": robot.fits, "low": low, "high": high}
                rows.append({**own, **_columns("fleet", given.get(name, UNKNOWN))})
        return pd.DataFrame(rows).set_index(["robot", "parameter"])

    to_frame = robots

    def population(self) -> pd.DataFrame:
        """One row per parameter: its mean, its standard deviation between robots, and a robot not measured yet.

        Without rows where fewer than two robots can be explained.
        """
        told = self.result
        rows: dict[str, dict[str, float]] = {name: {"varies": told.varies[name]} for name in told.mean}
        for key, figures in (("mean", told.mean), ("deviation", told.deviation), ("robots", told.next_robot)):
            for name, row in rows.items():
                row |= _columns(key, figures[name])
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("parameter")

    def document(self) -> dict[str, Any]:
        """The JSON document of `fleet --json`, without the files."""
        return report.fleet_document(self.result)

    def write(self, folder: str | Path, command: str = "") -> tuple[Path, Path]:
        """Write the figure and report.html into a folder; their paths.

        Raises:
            RunError: If a file cannot be written.
        """
        drawn, page = self.figures(), Path(folder) / "report.html"
        (figure,) = report.save_figures(drawn, Path(folder))
        foot = report.study_foot(self.result.settings, command)
        report.write_page(page, report.fleet_view(self.result, drawn["fleet"]), foot)
        return figure, page


def _columns(key: str, told: Estimate) -> dict[str, float]:
    return {f"{key}_low": told.low, f"{key}_middle": told.value, f"{key}_high": told.high}


def fleet(path: str | Path, targets: Sequence[str | Path]) -> FleetReport:
    """Tell θ of several robots of one kind, and p(θ) over them, from the trials that a study or bank knows.

    No episode is driven.

    Args:
        path: The study's or bank's folder, or its study.toml.
        targets: The table of scores of each robot, measured with the study's agents.

    Raises:
        InputError: If the study knows no trial, or a table cannot be used.
        RunError: If no trial has an outcome.
    """
    if isinstance(targets, str | Path):
        raise InputError(f"targets: give a list of tables, one per robot, got {str(targets)!r}")
    return FleetReport(learn_fleet(Path(path), [Path(one) for one in targets]))
