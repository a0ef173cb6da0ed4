"""A loop on the planar plant that takes seconds: few agents, short episodes, a short log.

Launched processes are changed by it: the log that `loop` records of a twin is short, and few effects are looked for.
"""

import json

from proxytune.api import Wanted
from proxytune.diagnosis.motion import diagnose as selecting, screening
from proxytune.loop import diagnosing

STUDY = """\
format = 1
name = "tiny"
target = "target.csv"
truth = "twin.toml"
metrics = ["distance:max", "survival_time:max"]
agents = ["steady", "brisk", "daredevil"]
held_out = ["crawler", "laggy", "edges"]
starts = 2
budget = 4
initial = 3
preflight = false

[parameters]
trim = [-0.3, 0.3]
delay = [0.0, 0.3]

[domain]
robot = "duckiebot"
plant = "planar"
seconds = 2.0
"""
RIGHTING = ('"crawler", "laggy", "edges"', '"yellow_only", "laggy", "smooth"')
"""A change of study.toml: without a dead band the first of these leaves the road, and comes last instead of first."""
TWIN = """\
format = 1
robot = "duckiebot"
plant = "planar"
[effects.trim]
trim = 0.06
[effects.delay]
delay = 0.19
[effects.dead_band]
width = 0.15
"""
FOUND = TWIN.replace("0.15", "0.149")
ERROR = {
    "horizon_s": 2.0,
    "before": 0.08,
    "before_interval": [0.07, 0.09],
    "after": 0.004,
    "after_interval": [0.0039, 0.0041],
    "noise_floor": 0.0039,
    "noise_floor_upper": 0.0042,
    "unit": "m",
}
DIAGNOSIS = {
    "verdict": "explained",
    "effects": [{"name": "dead_band"}],
    "extended": {"trim": {"value": 0.06}, "delay": {"value": 0.19}, "width": {"value": 0.149}},
    "error": ERROR,
    "camera": None,
    "could_not_be_seen": ["saturation"],
    "next_manoeuvre": None,
}
"""As much of a diagnosis.json as a loop reads."""


def write_tiny(folder, *changes):
    """A study with its twin; changes are pairs of texts in study.toml."""
    folder.mkdir(exist_ok=True)
    text = STUDY
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "study.toml").write_text(text, encoding="utf-8")
    (folder / "twin.toml").write_text(TWIN, encoding="utf-8")
    return folder


def short(frames=0, seed=1):
    """A log of eight drives of 15 s."""
    return Wanted(1, 15.0, min(frames, 8), seed)


def write_diagnosis(folder, **changes):
    """What `diagnose` would write into this folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.toml").write_text(FOUND, encoding="utf-8")
    (folder / "diagnosis.json").write_text(json.dumps({**DIAGNOSIS, **changes}), encoding="utf-8")


def change():
    """In a process of its own."""
    diagnosing.Wanted = short
    screening.motion_effects = lambda catalogue: ("dead_band", "motor_lag", "stiction")
    selecting.has_body = lambda drives: False
