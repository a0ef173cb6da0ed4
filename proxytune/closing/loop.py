"""The loop: tune, diagnose, extend, tune again, compare; whatever was done is kept."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from proxytune.api.recording import record_log
from proxytune.api.studies import StudyReport, most_episodes, run_opened
from proxytune.closing.closed import Closed
from proxytune.closing.diagnosing import (
    adds_something,
    check_camera,
    declared_names,
    diagnose_target,
    read_diagnosis,
    wanted_of,
)
from proxytune.closing.episodes import pictures_file, write_pictures
from proxytune.closing.extension import begin_anew_if_changed, extension_text, files_of, write_extension
from proxytune.closing.held_out import drive_held_out, held_out_settings, scored_agents
from proxytune.closing.opening import Loop
from proxytune.closing.righted import righted
from proxytune.closing.steps import Kept, Step, Teller, digest, digest_of_files
from proxytune.driving.robot import robot_home
from proxytune.errors import InputError
from proxytune.scores import write_scores
from proxytune.seeds import target_seed
from proxytune.storage.lock import locked
from proxytune.study.measure import measure
from proxytune.study.own_code import code_of
from proxytune.study.settings import FILE_NAME, StudySettings
from proxytune.study.study import Study, open_study
from proxytune.usefulness import Assessment
from proxytune.versions import versions_of

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


def close_loop(loop: Loop, teller: Teller) -> Closed:
    """Do every step that is not done.

    Stopped at any moment, it goes on when it is called again: what was finished is kept.

    Raises:
        ProxytuneError: From any step, as the command that does the same; what was finished is kept.
    """
    check_camera(loop)
    with locked(loop.home):
        return _Closing(loop, teller, Kept(loop.home)).run()


@dataclass
class _Closing:
    """A loop on its way."""

    loop: Loop
    teller: Teller
    kept: Kept
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
        if adds_something(diagnosis):
            after = self._tune("extended study", self._extend())
            held_out = self._held_out(before, after)
        closed = Closed(self.loop, before, diagnosis, after, held_out, (), self.episodes)
        self._show_righted(closed)
        return replace(closed, done=tuple(self.done))

    def _begin(self, name: str, how: str = "") -> None:
        place = list(STEPS).index(name) + 1
        self.teller.say(f"step {place} of {len(STEPS)}, {STEPS[name]}{how and ': '}{how}")

    def _keep(self, name: str, inputs: str, output: Path, do: Callable[[], object]) -> None:
        """Do a step unless it is done."""
        step = Step(name, inputs, output, do)
        known = self.kept.has(step)
        self._begin(name, "kept" if known else "")
        if not known:
            self.kept.run(step)
            self.done.append(name)

    def _measure_target(self) -> None:
        """Measure the twin where the study has no scores of its target yet."""
        settings, twin, name = self.settings, self.loop.twin, "target"
        if twin is None or (settings.target.exists() and self.kept.inputs_of(name) is None):
            self._begin(name, "given")
            return
        inputs = digest(name, twin.read_text(encoding="utf-8"), self._agents(settings.agents))
        if settings.target.exists() and self.kept.inputs_of(name) != inputs:
            raise InputError(
                f"{settings.target}: was measured of another model, or of other agents, starts, seed, [domain] or "
                "modules of your own; move it and study.db away to start again"
            )
        self._keep(name, inputs, settings.target, partial(self._measure, settings, settings.target))

    def _measure(self, settings: StudySettings, output: Path) -> None:
        assert self.loop.twin is not None
        with self.teller.episodes(len(settings.agents) * settings.starts) as watcher:
            scores = measure(settings, self.loop.twin, target_seed(settings.seed), watcher)
        self.episodes += len(settings.agents) * settings.starts
        write_scores(scores, output)

    def _tune(self, name: str, study: Study) -> StudyReport:
        """Run what is left of a study, and write its page."""
        self._begin(name)
        report = run_opened(study, self.teller.episodes(most_episodes(study.settings)), self.teller.say)
        self.episodes += report.spent.episodes
        if report.spent.episodes:
            self.done.append(name)
        if report.spent.episodes or not (study.settings.folder / "report.html").exists():
            report.write()
        return report

    def _diagnose(self) -> Mapping[str, Any]:
        """Diagnose the given log, or the twin's."""
        loop, home = self.loop, self.loop.home / "diagnosed"
        log, seen = self._record() if loop.log is None else (loop.log, digest_of_files(loop.log))
        if loop.log is not None:
            self._begin("log", "given")
        robot = digest_of_files(robot_home(loop.robot, self.settings.folder))
        made_by = (robot, code_of(self.settings), versions_of(["proxytune"]))
        inputs = digest("diagnosis", seen, declared_names(loop), self.settings.seed, made_by)
        do = partial(diagnose_target, loop, log, home, self.teller)
        self._keep("diagnosis", inputs, home / "diagnosis.json", do)
        return read_diagnosis(home)

    def _record(self) -> tuple[Path, str]:
        """Record the twin; the log, and a digest of what it was made of."""
        loop, folder, wanted = self.loop, self.loop.home / "log", wanted_of(self.loop)
        assert loop.twin is not None
        twin, domain = loop.twin.read_text(encoding="utf-8"), self.settings.domain.values
        inputs = digest("log", twin, domain, vars(wanted), code_of(self.settings), versions_of(["proxytune"]))
        do = partial(record_log, self.settings, loop.twin, folder, wanted, lambda line: None)
        self._keep("log", inputs, folder / "log.toml", do)
        return folder, inputs

    def _extend(self) -> Study:
        """Write the extended study, and open it."""
        settings, folder, model = (
            self.settings,
            self.loop.home / "extended",
            self.loop.home / "diagnosed" / "model.toml",
        )
        files = [(path.name, digest_of_files(path)) for path in files_of(settings)]
        inputs = digest("extension", extension_text(settings, model, folder), digest_of_files(model), files)
        do = partial(write_extension, settings, model, folder)
        self._keep("extension", inputs, folder / FILE_NAME, do)
        study = open_study(folder)
        begin_anew_if_changed(study)
        return study

    def _held_out(self, before: StudyReport, after: StudyReport) -> tuple[Assessment, Assessment] | None:
        """Drive the held-out agents in both tuned proxies."""
        names, name = self.loop.held_out, "held-out agents"
        if not names:
            self._begin(name, "there are none")
            return None
        target = self._held_out_target(names)
        self._begin(name)
        studies = [(report.result.study, report.theta) for report in (before, after)]
        with self.teller.episodes(4 * len(names) * self.settings.starts) as watcher:
            driven = [
                drive_held_out(study, held_out_settings(study.settings, names, target), theta, watcher)
                for study, theta in studies
            ]
        episodes = sum(one.episodes for one in driven)
        self.episodes += episodes
        self.done += [name] if episodes else []
        return driven[0].assessment, driven[1].assessment

    def _show_righted(self, closed: Closed) -> None:
        """Draw the righted agent's episodes, where there is a proxy after."""
        if closed.after is None:
            return
        name, twin, home = "righted agent", self.loop.twin, self.loop.home
        seen = twin and twin.read_text(encoding="utf-8"), digest_of_files(home / "diagnosed" / "model.toml")
        thetas = [dict(report.theta) for report in (closed.before, closed.after)]
        metrics = [metric.name for metric in self.settings.metrics]
        inputs = digest(name, righted(closed), seen, thetas, metrics, self._agents(self.settings.agents))
        self._keep(name, inputs, pictures_file(home), partial(write_pictures, closed))

    def _held_out_target(self, names: tuple[str, ...]) -> Path | None:
        """The target's scores of held-out agents: a file of their own, or None where the study's table has them."""
        name, output = "held-out scores", self.loop.home / "held_out.csv"
        if self.loop.twin is None or set(names) <= set(scored_agents(self.settings)):
            self._begin(name, "given")
            return None
        inputs = digest(name, self.loop.twin.read_text(encoding="utf-8"), self._agents(names))
        do = partial(self._measure, held_out_settings(self.settings, names), output)
        self._keep(name, inputs, output, do)
        return output

    def _agents(self, names: tuple[str, ...]) -> list[Any]:
        """What scores of a domain depend on besides its model."""
        settings, code = self.settings, code_of(held_out_settings(self.settings, names))
        return [names, dict(settings.aliases), settings.starts, settings.seed, dict(settings.domain.values), code]
