"""A user's effect beside a study, or in a plug-in, is simulated, written and read as a shipped one is.

test_extending.py has one found by `diagnose`.
"""

import re

import pytest
from one_line import complaint_of
from planted import ROBOT

from proxytune.cli.main import main
from proxytune.diagnosis.log_diagnosis import _say_untried
from proxytune.diagnosis.motion.diagnose import declared_parameters
from proxytune.diagnosis.motion.screening import motion_effects
from proxytune.driving import lane_following
from proxytune.effects import Catalogue, Model, effect_of, effects_from, model_text, read_model
from proxytune.extensions.door import GROUP
from proxytune.settings import Section

WEAK_REVERSE = '''"""An effect of one's own."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from proxytune.effects import Cue, Draws, FilterContext, Form, Means, Panel, Signal, Stage, Trace
from proxytune.space import Parameter


@dataclass(frozen=True)
class WeakReverse:
    """The robot is slower backwards than forwards."""

    loss: float
    name: ClassVar[str] = "weak_reverse"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="loss", unit="", low=0.0, high=0.9, neutral=0.0,
            probes=(0.02, 0.05, 0.1, 0.2, 0.4, 0.8), source="made up",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.DIRECTION,),
        shown=Means(Cue.DIRECTION, (Panel("forward", "forward speed [m/s]", "forward"),)),
    )

    def begin(self, context: FilterContext) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Slow down what is backwards."""
        forward = signal[..., :1]
        slowed = np.where(forward < 0.0, (1.0 - self.loss) * forward, forward)
        return np.concatenate((slowed, signal[..., 1:]), axis=-1), None
'''

NAME = "weak_reverse:WeakReverse"

WRONG = {
    "no trace": ("    trace: ClassVar[Trace | None] = ", "    track = ", "lacks trace; add"),
    "a stage in words": (
        "stage: ClassVar[Stage] = Stage.MOTION",
        'stage = "motion"',
        "has the stage 'motion'; take one of .*motion",
    ),
    "no parameters": (
        "    def begin",
        "    parameters = ()\n\n    def begin",
        r"has the parameters \(\); give a tuple of at least one Parameter",
    ),
    "a neutral value out of its range": (
        "neutral=0.0",
        "neutral=1.5",
        r"parameter 'loss' whose neutral value 1.5 is not within \[0, 0.9\]",
    ),
    "a range upside down": ("low=0.0", "low=2.0", "parameter 'loss' from 2.0 to 0.9; give a finite range"),
    "a usual range beyond what can be": (
        "neutral=0.0,",
        "neutral=0.0, usual=(0.0, 1.0),",
        r"parameter 'loss' with the usual range \[0.0, 1.0\], which is not within \[0, 0.9\]; widen that",
    ),
    "no probes": ("probes=(0.02, 0.05, 0.1, 0.2, 0.4, 0.8),", "", "has a trace, but 'loss' has no probes"),
    "another field": ("    loss: float", "    lost: float", "has the fields lost; its parameters are loss"),
    "another shape": (
        "return np.concatenate((slowed, signal[..., 1:]), axis=-1), None",
        "return slowed, None",
        "makes a signal",
    ),
    "no memory": ("signal[..., 1:]), axis=-1), None", "signal[..., 1:]), axis=-1)", "answers with ndarray; apply must"),
    "a bug": ("self.loss)", "self.lost)", "raised AttributeError: .*lost.*; correct its begin and apply"),
    "not neutral": ("(1.0 - self.loss)", "(0.9 - self.loss)", r"changes the signal at its neutral value \[0.0\]"),
    "chance": (
        "cues=(Cue.DIRECTION,),",
        "cues=(Cue.DIRECTION,), draws=Draws(lambda value, rate: None, (0.1, 1.0)),",
        "draws at random, which only shipped ones may",
    ),
    "a probe out of its range": ("0.4, 0.8)", "0.4, 1.8)", r"parameter 'loss' with a probe 1.8 that is not within"),
    "a bug at one end": (
        "forward = signal[..., :1]\n",
        "forward = signal[..., :1] if self.loss < 0.9 else None\n",
        r"raised TypeError: .* at \[0.9\]; correct its begin and apply",
    ),
    "no cue": ("cues=(Cue.DIRECTION,),", "cues=(),", r"a trace with the cues \(\); give a tuple of at least one"),
    "no figure": ("shown=Means(", "shown=(", "is to be shown by .*; give its trace a WheelCurve, or Means with panels"),
    "a panel of no motion": ('"forward"),))', '"speed"),))', "has a panel of the motion 'speed'; take one of forward,"),
    "a panel of no signal": ('(Panel("forward"', '(Panel("speed"', "a panel of the signal 'speed'; leave it empty,"),
    "no panel": ('(Panel("forward", "forward speed [m/s]", "forward"),)', "()", "take a Cue and at least one Panel"),
    "a form of another": (
        "cues=(Cue.DIRECTION,),",
        'cues=(Cue.DIRECTION,), forms=(Form((("lost",),)),),',
        "has a form with the parameter 'lost'; its parameters are loss",
    ),
    "no class": ("class WeakReverse:", "class Other:", "weak_reverse has no 'WeakReverse'"),
}
"""What is replaced in it, by what, and what is said of that."""
TABLE = f'format = 1\nrobot = "duckiebot"\n\n[effects."{NAME}"]\nloss = 0.3\n'
TWO = WEAK_REVERSE.replace("    loss: float\n", "    loss: float\n    bias: float\n").replace(
    "        ),\n    )\n",
    '        ),\n        Parameter(name="bias", unit="m/s", low=0.0, high=0.1, neutral=0.0, probes=(0.05,)),\n    )\n',
)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "weak_reverse.py").write_text(WEAK_REVERSE, encoding="utf-8")
    return tmp_path


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A site with a plug-in effect of the name `slow_back`."""
    info = tmp_path / "site" / "slow_back_pack-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: slow_back_pack\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{GROUP}]\neffect.slow_back = slow_back_pack:WeakReverse\n")
    unsourced = WEAK_REVERSE.replace(' source="made up",', "")
    (tmp_path / "site" / "slow_back_pack.py").write_text(unsourced, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))


def test_the_effect_of_a_parameter_is_told_from_its_name_which_several_add_to_the_effect_s(folder):
    (folder / "two.py").write_text(TWO, encoding="utf-8")
    catalogue = Catalogue(folder)
    assert catalogue.theta_names(NAME) == (NAME,)
    assert catalogue.theta_names("two:WeakReverse") == ("two:WeakReverse.loss", "two:WeakReverse.bias")
    assert catalogue.parameters["two:WeakReverse.bias"].unit == "m/s"
    assert "two:WeakReverse.lost" not in catalogue.parameters
    assert "two:WeakReverse" not in catalogue.parameters
    assert effect_of("dead_band.width") == "dead_band"
    assert effect_of("lab.motion.drift:Drift") == "lab.motion.drift:Drift"
    assert effect_of("lab.motion.drift:Drift.rate") == "lab.motion.drift:Drift"


def test_two_folders_have_effects_of_one_name_each_its_own_after_the_shipped_ones_of_its_stage(folder, tmp_path):
    made = effects_from({NAME: 0.3, "turn_slip": 0.01, "trim": 0.1}, ROBOT.figures, Catalogue(folder))
    assert [effect.name for effect in made] == ["trim", "turn_slip", "weak_reverse"]
    assert "must be between 0 and 0.9" in complaint_of(effects_from, {NAME: 1.0}, ROBOT.figures, Catalogue(folder))
    other = tmp_path / "other"
    other.mkdir()
    (other / "weak_reverse.py").write_text(WEAK_REVERSE.replace("high=0.9", "high=0.85"), encoding="utf-8")
    assert Catalogue(folder).parameters[NAME].high == 0.9
    assert Catalogue(other).parameters[NAME].high == 0.85


def test_model_toml_names_it_in_quotes_and_reads_back_the_same(folder):
    model = Model("duckiebot", None, {NAME: 0.25, "trim": 0.1}, {NAME: (0.2, 0.3)})
    catalogue = Catalogue(folder)
    path = folder / "model.toml"
    path.write_text(model_text(model, catalogue=catalogue), encoding="utf-8")
    assert f'[effects."{NAME}"]' in path.read_text(encoding="utf-8")
    assert read_model(path, catalogue) == model
    path.write_text(TABLE.replace("weak_reverse:", "weak_revers:"), encoding="utf-8")
    told = complaint_of(read_model, path, catalogue)
    assert re.search("model.toml: effects.weak_revers:WeakReverse: effect .* no module 'weak_revers'", told)


@pytest.mark.parametrize(("old", "new", "expected"), WRONG.values(), ids=WRONG)
def test_an_effect_that_is_not_what_it_claims_is_refused_by_name(tmp_path, old, new, expected):
    text = WEAK_REVERSE.replace(old, new)
    assert text != WEAK_REVERSE
    (tmp_path / "weak_reverse.py").write_text(text, encoding="utf-8")
    assert re.search(f"effect '{NAME}'.*{expected}", complaint_of(Catalogue(tmp_path).effect, NAME))


def test_a_domain_takes_it_from_its_table_theta_or_a_model_and_tells_how_to_name_an_unknown_one(folder):
    (folder / "model.toml").write_text(TABLE, encoding="utf-8")
    section = Section(folder / "study.toml", "domain.", {"plant": "planar", "seconds": 2.0})
    plain, given = (lane_following(section, model=model) for model in (None, folder / "model.toml"))
    held = Section(section.path, "domain.", {**section.values, "effects": {NAME: {"loss": 0.3}}})
    assert given == lane_following(held, model=None) != plain
    assert plain.parameters[NAME].high == 0.9
    assert plain.instance({NAME: 0.3}).drivetrain == given.instance({}).drivetrain
    (folder / "model.toml").write_text(TABLE.replace(f'"{NAME}"', "weak_revers"), encoding="utf-8")
    told = complaint_of(read_model, folder / "model.toml", Catalogue(folder))
    assert re.search("weak_revers: no such effect; .*your own is written module:Attribute", told)


def test_a_plugin_s_effect_takes_part_by_itself_and_is_listed_without_empty_lines(installed, folder, answered, capsys):
    catalogue, model = Catalogue(folder), Model("duckiebot", None, {"slow_back": 0.3}, {})
    assert "slow_back" in motion_effects(catalogue)
    assert "[effects.slow_back]" in model_text(model, catalogue=catalogue)
    (row,) = [row for row in answered("list", "effects")["effects"] if row["effect"] == "slow_back"]
    assert (row["parameter"], row["stage"], row["high"], row["shape"]) == ("slow_back", "motion", 0.9, "")
    assert main(["list", "effects", "slow_back"]) == 0
    assert capsys.readouterr().out.endswith("slow_back, 0 to 0.9, without effect at 0\n")


def test_an_effect_without_a_trace_is_said_to_be_untried_and_cannot_be_declared(folder):
    path = folder / "weak_reverse.py"
    begin, end = WEAK_REVERSE.index("Trace(\n"), WEAK_REVERSE.index("    def begin")
    path.write_text(f"{WEAK_REVERSE[:begin]}None\n\n{WEAK_REVERSE[end:]}")
    catalogue = Catalogue(folder, (NAME,))
    assert list(_say_untried(Catalogue())) == []
    (said,) = _say_untried(catalogue)
    assert said.startswith(f"effect '{NAME}' has no trace")
    assert f"--declared {NAME}: has no trace" in complaint_of(declared_parameters, (NAME,), catalogue)
