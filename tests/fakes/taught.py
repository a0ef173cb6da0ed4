"""Studies whose domain family is a schoolroom, and a twin to teach for; and the same without a study."""

from dataclasses import fields, replace

from schoolroom import Matrix, Schoolroom
from several import make_several
from wobbly import Wobbly

from proxytune.learning import Cache, Distribution, TeachingSettings
from proxytune.running import Silent
from proxytune.study import read_study_settings
from proxytune.teaching import load_setup, run_experiment
from proxytune.teaching.points import TeachingSetup

TEACHING = """
[teaching]
target = "twin.toml"
learner = "schoolroom:Matrix"
proxy_samples = 300
target_samples = {grid}
seeds = 3
lesson_s = 2.0
tolerance = 6.0
{more}
[teaching.proxies.right]
trim = 0.12
delay = 0.21
[teaching.proxies.wrong]
trim = -0.3
[teaching.proxies.wide]
trim = [0.0, 0.3]
delay = [0.1, 0.3]
"""
GRID = [0, 20, 40, 80, 160, 320, 640]


def make_taught(make_study, *, grid=GRID, more="", **changes):
    """A study's folder with a [teaching] table; `more` are further keys and tables of it."""
    folder = make_study(**{"family": '"schoolroom:schoolroom"', **changes})
    (folder / "twin.toml").write_text("trim = 0.12\ndelay = 0.21\n")
    path = folder / "study.toml"
    path.write_text(path.read_text() + TEACHING.format(grid=grid, more=more))
    return folder


def make_taught_families(make_study, families, *, grid, twin, **changes):
    """A study's folder whose families, several schoolrooms, teach for this twin."""
    table = TEACHING.format(grid=grid, more="").split("[teaching.proxies.right]")[0]
    folder = make_several(make_study, families=table + families, **{"family": '"schoolroom:schoolroom"', **changes})
    (folder / "twin.toml").write_text(twin)
    return folder


def run(folder, watcher=None):
    """The learning experiment of a study's folder, run to its end."""
    settings = read_study_settings(folder)
    return run_experiment(settings, load_setup(settings), watcher or Silent())


PROXY = Distribution({"trim": (0.1, 0.2)})


def setup(folder, **changes):
    """An experiment ready to run, small, with changes of it or of its settings."""
    own = {one.name for one in fields(TeachingSetup)}
    amounts = {key: changes.pop(key) for key in changes.keys() - own}
    settings = TeachingSettings(
        target=folder / "twin.toml",
        learner="schoolroom:Matrix",
        proxy_samples=60,
        target_samples=(0, 20, 40),
        seeds=1,
        lesson_s=2.0,
        level=None,
        tolerance=6.0,
        budget=1,
        narrow=False,
        widths={},
        proxies={"near": PROXY},
    )
    plain = TeachingSetup(
        proxy=Schoolroom(Wobbly()),
        target=Schoolroom(Wobbly(theta=(("trim", 0.12), ("delay", 0.21)))),
        learner=Matrix(),
        learner_identity="matrix",
        settings=replace(settings, **amounts),
        seed=1,
        starts=3,
        cache=Cache(folder),
    )
    return replace(plain, **changes)
