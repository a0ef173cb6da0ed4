"""The loop: tune, diagnose, extend, tune again, compare; whatever was done is kept.

`run_loop` does every step of STEPS that is not done, and a LoopReport tells the closed loop as a table, as one JSON
document and as one page.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure
from rich.console import Group
from rich.text import Text

from proxytune import report
from proxytune.api import StudyReport, most_episodes, record_log, run_opened
from proxytune.driving import robot_home
from proxytune.errors import InputError
from proxytune.identity import versions_of
from proxytune.loop import comparison, diagnosing, opening
from proxytune.loop.episodes import Closed, pictures_file, read_pictures, righted, write_pictures
from proxytune.scores import write_scores
from proxytune.seeds import target_seed
from proxytune.storage import locked
from proxytune.study import FILE_NAME, Study, StudySettings, measure_agents, open_study, user_code
from proxytune.usefulness import Assessment

STEPS = {
    "target": "the target's scores",
    "study": "tuning without",
    "log": "the target's log",
    "diagnosis": "what does the proxy lack?",
    "extension": "the proxy extended",
    "extended study": "tuning again",
    "held-out scores": "the target's scores of held-out agents",
    "held-out agents": "held-out agents in both tuned proxies",
    "righted agent": "the righted agent on its way",
}
"""The steps in their order, as they are told."""


@dataclass
class _Closing:
    """A loop on its way."""

    loop: opening.Loop
    teller: opening.Teller
    kept: opening.Kept
    done: list[str] = field(default_factory=list)
    episodes: int = 0

    @property
    def settings(self) -> StudySettings:
        return self.loop.settings

    def run(self) -> Closed:
        self._measure_target()
        before = self._tune("study", open_study(self.settings.path))
        diagnosis = self._diagnose()
        after, held_out = None, None
        if comparison.added_effects(diagnosis) or diagnosis.get("learnt", {}).get("used"):
            after = self._tune("extended study", self._extend())
            held_out = self._held_out(before, after)
        closed = Closed(self.loop, before, diagnosis, after, held_out, (), self.episodes)
        if after:
            name, twin, model = "righted agent", self.loop.twin, self.loop.home / "diagnosed" / "model.toml"
            seen = twin and twin.read_text(encoding="utf-8"), opening.digest_of_files(model)
            thetas = [dict(one.theta) for one in (before, after)]
            metrics = [metric.name for metric in self.settings.metrics]
            inputs = opening.digest(name, righted(closed), seen, thetas, metrics, self._agents(self.settings.agents))
            self._keep(name, inputs, pictures_file(self.loop.home), partial(write_pictures, closed))
        return replace(closed, done=tuple(self.done))

    def _begin(self, name: str, how: str = "") -> None:
        place = list(STEPS).index(name) + 1
        self.teller.say(f"step {place} of {len(STEPS)}, {STEPS[name]}{how and ': '}{how}")

    def _keep(self, name: str, inputs: str, output: Path, do: Callable[[], object]) -> None:
        known = self.kept.has(name, inputs, output)
        self._begin(name, "kept" if known else "")
        if not known:
            self.kept.run(name, inputs, do)
            self.done.append(name)

    def _measure_target(self) -> None:
        """Measure the twin where the study has no scores of its target yet."""
        settings, twin, name = self.settings, self.loop.twin, "target"
        if twin is None or (settings.target.exists() and name not in self.kept.inputs):
            self._begin(name, "given")
            return
        inputs = opening.digest(name, twin.read_text(encoding="utf-8"), self._agents(settings.agents))
        if settings.target.exists() and self.kept.inputs[name] != inputs:
            raise InputError(
                f"{settings.target}: was measured of another model, or of other agents, starts, seed, [domain] or "
                "modules of your own; move it and study.db away to start again"
            )
        self._keep(name, inputs, settings.target, partial(self._measure, settings, settings.target))

    def _measure(self, settings: StudySettings, output: Path) -> None:
        assert self.loop.twin is not None
        with self.teller.episodes(len(settings.agents) * settings.starts) as watcher:
            scores = measure_agents(settings, self.loop.twin, target_seed(settings.seed), watcher, warn=self.teller.say)
        self.episodes += len(settings.agents) * settings.starts
        write_scores(scores, output)

    def _tune(self, name: str, study: Study) -> StudyReport:
        self._begin(name)
        tuned = run_opened(study, self.teller.episodes(most_episodes(study.settings)), self.teller.say)
        self.episodes += tuned.spent.episodes
        if tuned.spent.episodes:
            self.done.append(name)
        if tuned.spent.episodes or not (study.settings.folder / "report.html").exists():
            tuned.write()
        return tuned

    def _diagnose(self) -> Mapping[str, Any]:
        loop, home, versions = self.loop, self.loop.home / "diagnosed", versions_of(["proxytune"])
        if loop.log is None:
            assert loop.twin is not None
            log, wanted, twin = loop.home / "log", diagnosing.wanted_of(loop), loop.twin.read_text(encoding="utf-8")
            made_of = (twin, self.settings.domain.values, vars(wanted), user_code(self.settings), versions)
            seen = opening.digest("log", *made_of)
            do = partial(record_log, self.settings, loop.twin, log, wanted, lambda line: None)
            self._keep("log", seen, log / "log.toml", do)
        else:
            log, seen = loop.log, opening.digest_of_files(loop.log)
            self._begin("log", "given")
        robot = opening.digest_of_files(robot_home(loop.robot, self.settings.folder))
        made_by = (robot, user_code(self.settings), versions)
        inputs = opening.digest("diagnosis", seen, diagnosing.declared_names(loop), self.settings.seed, made_by)
        diagnose = partial(diagnosing.diagnose_target, loop, log, home, self.teller)
        self._keep("diagnosis", inputs, home / "diagnosis.json", diagnose)
        return diagnosing.read_diagnosis(home)

    def _extend(self) -> Study:
        settings, home = self.settings, self.loop.home
        folder, model = home / "extended", home / "diagnosed" / "model.toml"
        files = [(path.name, opening.digest_of_files(path)) for path in diagnosing.files_of(settings, self.loop.robot)]
        inputs = opening.digest(
            "extension", diagnosing.extension_text(settings, model, folder), opening.digest_of_files(model), files
        )
        do = partial(diagnosing.write_extension, settings, self.loop.robot, model, folder)
        self._keep("extension", inputs, folder / FILE_NAME, do)
        study = open_study(folder)
        diagnosing.begin_anew_if_changed(study)
        return study

    def _held_out(self, before: StudyReport, after: StudyReport) -> tuple[Assessment, Assessment] | None:
        names, name = self.loop.held_out, "held-out agents"
        if not names:
            self._begin(name, "there are none")
            return None
        target = self._held_out_target(names)
        self._begin(name)
        studies = [(one.result.study, one.theta) for one in (before, after)]
        with self.teller.episodes(4 * len(names) * self.settings.starts) as watcher:
            driven = [
                opening.drive_held_out(study, opening.held_out_settings(study.settings, names, target), theta, watcher)
                for study, theta in studies
            ]
        episodes = sum(count for _, count in driven)
        self.episodes += episodes
        if episodes:
            self.done.append(name)
        return driven[0][0], driven[1][0]

    def _held_out_target(self, names: tuple[str, ...]) -> Path | None:
        """The target's scores of held-out agents: a file of their own, or None where the study's table has them."""
        name, output = "held-out scores", self.loop.home / "held_out.csv"
        if self.loop.twin is None or set(names) <= set(opening.scored_agents(self.settings)):
            self._begin(name, "given")
            return None
        inputs = opening.digest(name, self.loop.twin.read_text(encoding="utf-8"), self._agents(names))
        do = partial(self._measure, opening.held_out_settings(self.settings, names), output)
        self._keep(name, inputs, output, do)
        return output

    def _agents(self, names: tuple[str, ...]) -> list[Any]:
        """All that scores of a domain depend on besides its model."""
        settings, code = self.settings, user_code(opening.held_out_settings(self.settings, names))
        return [names, dict(settings.aliases), settings.starts, settings.seed, dict(settings.domain.values), code]


@dataclass(frozen=True, repr=False)
class LoopReport(report.Shown):
    """A closed loop: before and after.

    Attributes:
        closed: All of it.
    """

    closed: Closed

    def __repr__(self) -> str:
        return f"LoopReport: {comparison.answer(self.closed.diagnosis, rows_of(self.closed))}"

    def view(self) -> report.View:
        """What the page shows."""
        return view_of(self.closed)

    def figures(self) -> dict[str, Figure]:
        """PRPV before and after, by name."""
        return {"prpv": comparison.prpv_figure(rows_of(self.closed))}

    def table(self) -> pd.DataFrame:
        """One row per measure: before, after; then noise floor and a random ranking."""
        found = _table(self.closed, rows_of(self.closed))
        return pd.DataFrame(found.rows, columns=[column.name or "measure" for column in found.columns])

    to_frame = table

    def document(self) -> dict[str, Any]:
        """All that `loop --json` prints but for its files; what differs from run to run is under `this_run`."""
        closed, rows = self.closed, dict[str, dict[str, Any]]()
        for row in rows_of(closed):
            levels = {"before": asdict(row.before), "after": None if row.after is None else asdict(row.after)}
            rows[row.key] = levels | ({"most": row.most} if row.most else {"unit": row.unit})
        held_out = {"agents": list(closed.loop.held_out), **rows.pop("held_out", {"before": None, "after": None})}
        camera = closed.diagnosis["camera"] or {}
        reports = (("before", closed.before), ("after", closed.after))
        return {
            "study": closed.loop.settings.name,
            "sentence": comparison.answer(closed.diagnosis, rows_of(closed)),
            "next": _next_step(closed),
            "steps": list(STEPS) if closed.after else list(STEPS)[:4],
            "verdict": closed.diagnosis["verdict"],
            "effects": closed.diagnosis["effects"],
            "camera": {"verdict": camera["verdict"], "effects": camera["effects"]} if camera else None,
            "theta": {side: None if one is None else one.theta for side, one in reports},
            "prpv": {**rows.pop("prpv"), "held_out": held_out},
            "error": closed.diagnosis.get("error"),
            "errors": rows,
            "righted": righted(closed),
            "this_run": {"steps": list(closed.done), "episodes": closed.episodes},
        }

    def write(self, command: str = "") -> Path:
        """Write the page into the loop's folder; its path.

        Raises:
            RunError: If it cannot be written.
        """
        page = self.closed.loop.home / "report.html"
        report.write_page(page, view_of(self.closed), report.study_foot(self.closed.loop.settings, command))
        return page


def run_loop(
    path: str | Path,
    *,
    log: str | Path | None = None,
    twin: str | Path | None = None,
    teller: opening.Teller | None = None,
) -> LoopReport:
    """Tune, diagnose, extend and tune again; every step that is done is kept.

    Stopped at any moment, it goes on when it is called again.

    Args:
        path: The study's folder, or its study.toml.
        log: The target's log, or what `import_log` reads; recorded from the twin where it is not given.
        twin: The target's model.toml, where it is a simulator; the study's key `truth` where it is not given.
        teller: Hears how it goes.

    Raises:
        InputError: If the study, the log or the twin cannot be used.
        RunError: If a step fails; all that was finished is kept.
    """
    loop = opening.open_loop(Path(path), *(Path(one) if one is not None else None for one in (twin, log)))
    diagnosing.check_camera(loop)
    with locked(loop.home):
        return LoopReport(_Closing(loop, teller or opening.Teller(), opening.Kept(loop.home)).run())


def rows_of(closed: Closed) -> list[comparison.Compared]:
    """Every measure before and after: PRPV, of held-out agents too, then the errors."""
    after = None if closed.after is None else closed.after.result.judged
    rows = [comparison.compare_prpv("prpv", "the agents tuned on", closed.before.result.judged, after)]
    if closed.held_out:
        names = len(closed.loop.held_out)
        rows.append(comparison.compare_prpv("held_out", f"{names} agents that no tuning saw", *closed.held_out))
    errors = comparison.compare_errors(closed.diagnosis)
    if closed.after is None:
        errors = [replace(row, after=None) for row in errors]
    return rows + errors


def text_of(closed: Closed, page: Path) -> Group:
    """A closed loop as `loop` prints it, with where its page is."""
    rows = rows_of(closed)
    sentence, table = Text(comparison.answer(closed.diagnosis, rows), style="bold"), _table(closed, rows)
    shown, theta = (report.table_text(one, ragged=True) for one in (replace(table, title=""), _theta_table(closed)))
    following = f"Next: {_next_step(closed)}"
    return report.group_texts(sentence, shown, *report.note_texts(table.notes), Text(), theta, following, str(page))


def view_of(closed: Closed) -> report.View:
    """A closed loop: before and after, its figures, and what each step said."""
    rows = rows_of(closed)
    home, shown = closed.loop.home, []
    if closed.after:
        shown = [report.picture_of("loop", "prpv", comparison.prpv_figure(rows)), *read_pictures(home)]
    of_camera = (closed.diagnosis["camera"] or {}).get("effects")
    for name in report.CAPTIONS["loop"]:
        # Of the camera there is a figure where it lacked nothing too
        file = home / "diagnosed" / f"{name}.svg"
        if file.is_file() and (of_camera or not name.startswith("camera")):
            shown.append(report.picture_of("loop", name, file.read_bytes()))
    lacks = comparison.lacking(closed.diagnosis) or "nothing that has a name"
    said = (
        f"Found: {lacks}; verdict: {closed.diagnosis['verdict']}.",
        f"Before: {closed.before.sentence}",
        *((f"After: {closed.after.sentence}",) if closed.after else ()),
    )
    beside = {"tuning without": "../report.html", "the diagnosis": "diagnosed/report.html"}
    beside |= {"tuning again": "extended/report.html", "the model that was found": "diagnosed/model.toml"}
    links = (f"[{title}]({name})" for title, name in beside.items() if (home / name).is_file())
    return report.View(
        title=f"{closed.loop.settings.name}: what did the simulator lack, and what is it worth?",
        sentence=comparison.answer(closed.diagnosis, rows),
        next_step=_next_step(closed),
        parts=(
            _table(closed, rows),
            _theta_table(closed),
            *shown,
            report.Paragraphs("What each step said", said),
            report.Paragraphs("Pages and files", (" · ".join(links),)),
        ),
    )


def _table(closed: Closed, rows: list[comparison.Compared]) -> report.Table:
    """Every measure before and after, with its noise floor and chance."""
    cells, same = list[tuple[str, ...]](), list[str]()
    for row in rows:
        title, sides = f"{row.title}, 0 to {row.most}" if row.most else row.title, (row.before, row.after)
        shown = [comparison.level_text(one, row.unit) for one in sides]
        if not row.most and shown[0] == shown[1]:
            same.append(f"{row.title} {shown[0]}")
            continue
        cells.append((title, *shown))
        for name, texts in (
            ("noise floor", [comparison.floor_text(one, row.unit) for one in sides]),
            ("chance", ["{:.1f} ± {:.1f}".format(*one.chance) if one and one.chance else "–" for one in sides]),
        ):
            if set(texts) != {"–"}:
                cells.append((f"  {name}", *texts))
    counted = "PRPV (proxy relative predictivity value) counts wrongly ordered pairs of agents at the best θ"
    notes = [f"{counted}; in brackets 95 % intervals"]
    if closed.after and not closed.held_out:
        notes.append(
            "no agent was held out: name at least three under held_out in study.toml that the target has scores of"
        )
    if same:
        notes.append(f"the same before and after: {'; '.join(same)}")
    columns = report.columns_of(("",), ("before", "after"))
    return report.Table("Before and after", columns, tuple(cells), tuple(notes))


def _theta_table(closed: Closed) -> report.Table:
    after = None if closed.after is None else _known(closed.after)
    return comparison.theta_table(_known(closed.before), after, closed.diagnosis)


def _known(tuned: StudyReport) -> comparison.Known:
    ends = tuned.result.knowledge.intervals
    return {name: (value, ends.get(name)) for name, value in tuned.theta.items()}


def _next_step(closed: Closed) -> str:
    last, model = closed.after or closed.before, closed.loop.home / "diagnosed" / "model.toml"
    return comparison.next_step(closed.diagnosis, last.sentence, str(model) if closed.after else "", last.theta)
