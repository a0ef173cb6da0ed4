"""What a loop cannot use is refused before anything is driven, and a step is done once for the same inputs."""

import os

import pytest
from tiny_loop import write_tiny

from proxytune.errors import StoreError
from proxytune.files import shipped
from proxytune.loop import open_loop
from proxytune.loop.opening import FILE_NAME, Kept, digest_of_files

LOG = 'format = 1\nname = "log"\nrobot = "husky"\ncommand = "duty"\nrate_hz = 20.0\n'
NO_TRUTH = ('truth = "twin.toml"\n', "")
TABLE = "agent,episode,distance,survival_time\n" + "".join(
    f"{agent},{start},1.0,2.0\n" for agent in ("steady", "brisk", "daredevil") for start in (0, 1)
)


def a_log(folder, text=LOG):
    folder.mkdir()
    (folder / "log.toml").write_text(text)
    rows = "".join(f"0,{0.05 * row:.2f},0.1,0.1,0.0,0.0,0.0\n" for row in range(40))
    (folder / "samples.csv").write_text("episode,time,left,right,x,y,heading\n" + rows)
    return folder


HELD_OUT = '["crawler", "laggy", "edges"]'
NOBODY_HELD_OUT = (f"held_out = {HELD_OUT}\n", "")
BLIND = 'format = 1\nrobot = "irobot_create"\nplant = "planar"\n'
HUSKY = 'format = 1\nrobot = "husky"\nplant = "planar"\n'
REFUSED = {
    "a log of another robot": (
        (), {}, "--log log", "is of the robot 'husky', the study of 'duckiebot'; give a log of 'duckiebot'",
    ),
    "a twin without a camera": (
        (('robot = "duckiebot"\n', ""),), {"twin.toml": BLIND}, "--twin tiny/twin.toml", "camera",
    ),
    "a twin of another robot": ((), {"twin.toml": HUSKY}, "", "is 'duckiebot' but the model says 'husky'"),
    "a twin that is not there": ((), {}, "--twin none.toml", "proxytune loop: --twin none.toml: no such file"),
    "an agent without a rank": (
        (NO_TRUTH,), {"target.csv": TABLE}, "", "held_out: the target's table has no scores of 'crawler'; measure them",
    ),
    "an agent that is tuned on": (
        ((HELD_OUT, '["crawler", "laggy", "steady"]'),), {}, "", "held_out: 'steady' is among the agents that",
    ),
    "too few agents": (((HELD_OUT, '["crawler", "laggy"]'),), {}, "", "held_out: names 2 of at least 3 agents"),
    "an agent that is none": (((HELD_OUT, '["crawler", "laggy", "nobody"]'),), {}, "", "held_out: agent 'nobody'"),
    "a target that can be neither read nor recorded": (
        (NO_TRUTH, NOBODY_HELD_OUT), {"target.csv": TABLE}, "", "give a log of it by --log LOG, or its model.toml by",
    ),
    "a search for learning value": (
        (('name = "tiny"', 'name = "tiny"\nobjective = "plv"'),), {}, "", "objective: `loop` tunes by scores",
    ),
    "no trials": (
        (("budget = 4", 'learn_from = ["../bank"]\nbudget = 0'),), {}, "", "budget: is 0, and of the proxy with what",
    ),
    "a folder that cannot be made": ((), {"loop": "a file"}, "", "loop is no folder; move that away"),
}  # fmt: skip
"""Changes of the study, files in its folder, words of the command, and what it says."""


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_used_is_refused_before_anything_is_driven(tmp_path, monkeypatch, refused, case):
    changes, files, words, says = REFUSED[case]
    monkeypatch.chdir(tmp_path)
    write_tiny(tmp_path / "tiny", *changes)
    a_log(tmp_path / "log")
    for name, text in files.items():
        (tmp_path / "tiny" / name).write_text(text)
    assert says in refused("loop", "tiny", *words.split())
    assert not (tmp_path / "tiny" / "study.db").exists()


def test_a_family_without_a_robot_is_refused(make_study, refused):
    assert "names no robot" in refused("loop", make_study())


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission_is_refused(tmp_path, refused):
    folder = write_tiny(tmp_path / "tiny")
    folder.chmod(0o500)
    try:
        assert "cannot be written" in refused("loop", folder)
    finally:
        folder.chmod(0o700)


def test_agents_that_no_tuning_sees_are_held_out_whatever_they_are_called(tmp_path):
    folder = write_tiny(tmp_path / "tiny", NOBODY_HELD_OUT)
    held_out = open_loop(folder).held_out
    assert {"crawler", "edges", "wary"} <= set(held_out)
    assert not {"steady", "brisk", "daredevil"} & set(held_out)

    table = '[agents]\nslow = "steady"\nfast = "brisk"\nwild = "daredevil"\n\n[parameters]'
    changes = (NOBODY_HELD_OUT, ('agents = ["steady", "brisk", "daredevil"]\n', ""), ("[parameters]", table))
    held_out = open_loop(write_tiny(tmp_path / "tiny", *changes)).held_out
    assert {"crawler", "edges", "wary"} <= set(held_out)
    assert not {"steady", "brisk", "daredevil", "slow", "fast", "wild"} & set(held_out)

    folder = write_tiny(tmp_path / "tiny", NO_TRUTH, NOBODY_HELD_OUT)
    log = a_log(tmp_path / "log", LOG.replace("husky", "duckiebot"))
    (folder / "target.csv").write_text(TABLE)
    assert open_loop(folder, log=log).held_out == ()
    (folder / "target.csv").write_text(TABLE + "edges,0,1.0,2.0\nlaggy,0,1.0,2.0\n")
    assert open_loop(folder, log=log).held_out == ()
    more = "".join(f"{agent},{start},1.0,2.0\n" for agent in ("edges", "laggy", "wary", "unknown") for start in (0, 1))
    (folder / "target.csv").write_text(TABLE + more)
    assert open_loop(folder, log=log).held_out == ("edges", "laggy", "wary")


def test_a_twin_of_which_no_frames_can_be_recorded_is_refused_before_anything_is_driven(tmp_path, refused):
    changes = (
        ('robot = "duckiebot"', 'robot = "robby"'),
        ("delay = [0.0, 0.3]", "delay = [0.0, 0.3]\nblur = [0.0, 0.1]"),
    )
    folder = write_tiny(tmp_path / "tiny", *changes)
    (folder / "twin.toml").write_text((folder / "twin.toml").read_text().replace("duckiebot", "robby"))
    figures = (shipped("robots") / "duckiebot" / "robot.toml").read_text().splitlines()
    (folder / "robby").mkdir()
    own = [line.replace("duckiebot", "robby") for line in figures if not line.startswith(("expert_", "urdf"))]
    (folder / "robby" / "robot.toml").write_text("\n".join(own))
    line = refused("loop", folder)
    assert "twin.toml: no frames can be recorded" in line
    assert "give a log of it by --log" in line
    assert not (folder / "study.db").exists()


def step(folder, inputs="a", name="log"):
    """A step, how to do it, and the inputs of which it was made."""
    done = []

    def do():
        done.append(inputs)
        (folder / name).write_text(inputs)

    return (name, inputs, folder / name), (name, inputs, do), done


def test_a_step_is_done_as_long_as_inputs_and_output_are_there(tmp_path):
    first, doing, done = step(tmp_path)
    assert not Kept(tmp_path).has(*first)
    Kept(tmp_path).run(*doing)
    assert done == ["a"]
    assert Kept(tmp_path).has(*first)
    assert not Kept(tmp_path).has(*step(tmp_path, "b")[0])

    (tmp_path / "log").unlink()
    assert not Kept(tmp_path).has(*first)
    Kept(tmp_path).run(*doing)

    def interrupted():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Kept(tmp_path).run("log", "b", interrupted)
    assert (tmp_path / "log").exists()
    assert not Kept(tmp_path).has(*first)
    assert not Kept(tmp_path).has(*step(tmp_path, "b")[0])

    kept, steps = Kept(tmp_path), [step(tmp_path), step(tmp_path, name="diagnosis")]
    for _, doing, _ in steps:
        kept.run(*doing)
    assert all(Kept(tmp_path).has(*one) for one, _, _ in steps)


@pytest.mark.parametrize("text", ["", "[]", '{"steps": 1}'])
def test_a_broken_file_is_one_line_with_a_remedy(tmp_path, text):
    (tmp_path / FILE_NAME).write_text(text)
    with pytest.raises(StoreError, match="remove it to do every step again"):
        Kept(tmp_path)


def test_a_digest_of_files_changes_with_content_names_and_a_single_hidden_file(tmp_path, write_file):
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "one").write_text("1")
    before = digest_of_files(tmp_path)
    (tmp_path / ".draft").write_text("half")
    (tmp_path / "__pycache__" / "one.pyc").write_text("compiled")
    assert digest_of_files(tmp_path) == before
    (tmp_path / "one").write_text("2")
    changed = digest_of_files(tmp_path)
    (tmp_path / "one").rename(tmp_path / "two")
    assert len({before, changed, digest_of_files(tmp_path)}) == 3

    model = write_file("1", ".model.toml")
    before = digest_of_files(model)
    model.write_text("2")
    assert digest_of_files(model) != before
