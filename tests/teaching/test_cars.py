"""The proxy teaches a car: the imitator learns throttle and steering from the expert, and PLV counts what it saved."""

import pytest

STUDY = """
format = 1
name = "taught_car"
objective = "plv"
target = "target.csv"
metrics = ["survival_time:max"]
agents = ["steady", "wary"]
starts = 2
budget = 1
initial = 1
seed = 1
[parameters]
steering_offset = [-0.2, 0.2]
[domain]
robot = "car"
map = "car_loop"
seconds = 3.0
[teaching]
target = "twin.toml"
proxy_samples = 600
target_samples = [0, 60]
seeds = 1
examinations = 8
lesson_s = 3.0
tolerance = 5.0
budget = 1
[teaching.proxies.right]
steering_offset = 0.05
[teaching.proxies.wrong]
steering_offset = -0.2
"""

TARGET = "agent,episode,survival_time\nsteady,1,5\nsteady,2,5\nwary,1,5\nwary,2,5\n"
TWIN = 'format = 1\nrobot = "car"\n[effects.steering_offset]\noffset = 0.05\n'


@pytest.mark.slow
def test_a_car_learns_in_either_proxy_to_drive_on_the_target(tmp_path, answered):
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    (tmp_path / "target.csv").write_text(TARGET, encoding="utf-8")
    (tmp_path / "twin.toml").write_text(TWIN, encoding="utf-8")
    document = answered("teach", tmp_path)
    right, wrong = (document["proxies"][name] for name in ("right", "wrong"))
    assert right["theta"] == {"steering_offset": 0.05}
    assert min(right["zero_shot"], wrong["zero_shot"]) > 2.8  # of 3 s; after 20 samples it is 1.5
