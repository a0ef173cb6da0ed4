"""Drive proxytune's manoeuvres with the robot in MuJoCo, and write what a tracker would see as a log.

python make_log.py truth.toml LOG
"""

import sys
from pathlib import Path

import numpy as np
from mujoco_duckiebot import family
from mujoco_plant import TICK_S

from proxytune.diagnosis import log_text, samples_text
from proxytune.diagnosis.motion.manoeuvres import LIBRARY
from proxytune.diagnosis.recording import tracked
from proxytune.logs import Log, LogEpisode
from proxytune.study import read_study_settings

RATE_HZ, SECONDS, REPEATS, SEED = 20, 60.0, 2, 0


def drive_manoeuvre(robot, number):
    """One manoeuvre: the second time mirrored and of another size."""
    random = np.random.default_rng((SEED, number))
    times = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    duties = LIBRARY[number % len(LIBRARY)][2](times) * random.uniform(0.75, 1.0)
    duties = np.round(duties if number < len(LIBRARY) else duties[:, ::-1], 4)
    start = np.array((0.0, 0.0, random.uniform(-np.pi, np.pi)))
    held = round(1.0 / RATE_HZ / TICK_S)
    with robot.plant_at(start, robot.held) as plant:
        poses, _ = plant.move(np.repeat(duties[:-1], held, axis=0))
    seen = np.concatenate((start[None], poses[held - 1 :: held]))
    return LogEpisode(str(number), times, duties, tracked(seen, random), None)


def main(model, folder):
    """Drive every manoeuvre and write the log."""
    robot = family(read_study_settings(Path(__file__).parent).domain, model=Path(model))
    drives = tuple(drive_manoeuvre(robot, number) for number in range(REPEATS * len(LIBRARY)))
    log = Log(Path(folder).name, "duckiebot", "duty", float(RATE_HZ), {}, drives)
    Path(folder).mkdir(exist_ok=True)
    Path(folder, "samples.csv").write_text(samples_text(log), encoding="utf-8")
    Path(folder, "log.toml").write_text(log_text(log, f"{Path(model).name} in MuJoCo"), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
