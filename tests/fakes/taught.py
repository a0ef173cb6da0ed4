"""Studies whose domain family is a schoolroom, and a twin to teach for."""

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
