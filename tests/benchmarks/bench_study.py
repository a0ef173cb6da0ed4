"""What a study costs: `python -m pytest tests/benchmarks/bench_study.py -o addopts= -s`. It prints and never fails."""

import json
import re
import shutil
import time
from pathlib import Path

import pytest

from proxytune.cli.main import main

STUDIES = Path(__file__).resolve().parents[2] / "studies"


def copy(tmp_path, name, **changes):
    folder = Path(shutil.copytree(STUDIES / name, tmp_path, ignore=shutil.ignore_patterns("study.db*", "figures")))
    path = folder / "study.toml"
    text = path.read_text(encoding="utf-8")
    for key, value in changes.items():
        text = re.sub(rf"^{key} = .*", f"{key} = {value}", text, flags=re.MULTILINE)
    path.write_text(text, encoding="utf-8")
    return folder


def test_two_jobs_against_one(tmp_path, capsys):
    """72 bullet episodes of up to a minute, the workers' start included."""
    seconds = {}
    for jobs in (1, 2):
        folder = copy(tmp_path / str(jobs), "known_answer", jobs=jobs, starts=6)
        begun = time.perf_counter()
        main(["measure", str(folder), "--model", str(folder / "truth.toml"), "--output", str(folder / "again.csv")])
        seconds[jobs] = time.perf_counter() - begun
    with capsys.disabled():
        print(f"\n1 job {seconds[1]:.1f} s, 2 jobs {seconds[2]:.1f} s: {seconds[1] / seconds[2]:.2f} times as fast")


@pytest.mark.parametrize("name", ["quickstart"])
def test_time_of_a_study_outside_of_its_episodes(tmp_path, capsys, name):
    """The whole quickstart study: proposals, database, scores, figures and report against all."""
    main(["study", str(copy(tmp_path / name, name)), "--json"])
    found = json.loads(capsys.readouterr().out)["seconds"]
    with capsys.disabled():
        share = found["outside_episodes"] / found["total"]
        print(f"\n{name}: {found['total']:.1f} s, of which {found['outside_episodes']:.1f} s outside: {share:.1%}")
