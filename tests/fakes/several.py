"""Studies of several families that are formulas; of one of them the target is an instance, of the other none is."""

STOP = "[stop]\nwall_time_s = {seconds}\n"
FAMILIES = '[families.right]\nproxy = "right.toml"\n[families.wrong]\nproxy = "wrong.toml"\n'
"""Both hold the delay, which is not searched."""


def make_several(make_study, *, families=FAMILIES, seconds=1000.0, **changes):
    """A study's folder with a [families] table: its time is not the limit unless that is said."""
    changes = {"confirm": "1", "parameters": {"trim": "[-0.3, 0.3]"}, **changes}
    folder = make_study(**changes)
    (folder / "right.toml").write_text("delay = 0.12\n")
    (folder / "wrong.toml").write_text("delay = 0.3\n")
    path = folder / "study.toml"
    stop = "" if seconds is None else STOP.format(seconds=seconds)
    path.write_text(f"{path.read_text()}{stop}{families}")
    return folder
