"""What large tables cost `score` in all: `python tests/benchmarks/bench_tables.py AGENTS EPISODES [PROXIES [MISSING]]`.

MISSING is of how many files one episode is missing, the target's first: agents are then resampled each by itself.
"""

import json
import resource
import sys
import tempfile
import time
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np

from proxytune.cli.main import main as proxytune

METRICS = "abc"


def write_scores(path: Path, skills: np.ndarray, episodes: int, random: np.random.Generator) -> None:
    """A file of agents of these skills (agents, metrics), each episode off by as much as skills differ."""
    scores = skills[:, None] + random.standard_normal((len(skills), episodes, len(METRICS)))
    rows = (
        f"A{agent},{episode},{','.join(f'{value:.6f}' for value in scores[agent, episode])}\n"
        for agent in range(len(skills))
        for episode in range(episodes)
    )
    path.write_text(f"agent,episode,{','.join(METRICS)}\n{''.join(rows)}")


def main() -> None:
    """Score generated tables as the command does, and print processor time and peak memory."""
    agents, episodes, proxies, missing = (*map(int, sys.argv[1:]), *(1, 0)[len(sys.argv) - 3 :])
    random = np.random.default_rng(0)
    skills = random.standard_normal((agents, len(METRICS)))
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"{name}.csv" for name in ("target", *map(str, range(proxies)))]
        for place, path in enumerate(files):
            shift = 0.3 * random.standard_normal(skills.shape) if place else 0.0
            write_scores(path, skills + shift, episodes, random)
            if place < missing:
                path.write_text(path.read_text().rpartition("A")[0])
        target, *others = map(str, files)
        sides = ["--target", target, *(word for name in others for word in ("--proxy", name))]
        begin, out = time.process_time(), StringIO()
        with redirect_stdout(out):
            proxytune(["score", *sides, *(word for name in METRICS for word in ("--metric", f"{name}:max")), "--json"])
        spent = time.process_time() - begin
    document = json.loads(out.getvalue())
    found = [one["prpv"] for one in document.get("proxies", [document])]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    compared = f"{agents} agents × {episodes} episodes, {proxies} proxies, {missing} tables incomplete"
    print(f"{compared}: {spent:.1f} s, {peak:.0f} MiB; PRPV {found[:3]}")


if __name__ == "__main__":
    main()
