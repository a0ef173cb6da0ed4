"""What goes wrong around a study, through the real command line: one line, the right status, and nothing lost."""

import os
import re
import resource
import shutil
import subprocess
from pathlib import Path

import pytest
from processes import besides_progress, episodes, start, trials
from searched import searched
from stopping import Stopping

from proxytune.cli.main import main
from proxytune.search import make_proposer
from proxytune.storage import Store
from proxytune.study import StudyRun, check_facts, open_study, run_trials

slow = pytest.mark.slow


@pytest.fixture(scope="module")
def half_once(make_studies):
    folder = make_studies("half")
    with pytest.raises(KeyboardInterrupt):
        searched(open_study(folder), Stopping(80))
    return folder


@pytest.fixture
def half(half_once, tmp_path):
    """A study stopped in the middle of its fifth trial, where `make_study` edits it."""
    return Path(shutil.copytree(half_once, tmp_path / "half"))


def run(*words, status=0, **how):
    """A command as a process of its own: its one line on standard error, or what it printed where all went well."""
    process = start(*words, **how)
    out, told = process.communicate(timeout=120)
    told = besides_progress(told)
    assert process.returncode == status, told
    if status == 0:
        return out
    assert (out, told.count("\n")) == ("", 1)
    return told


def goes_on(folder, finished):
    """Run to the end: trials and episodes are those of a study that has never been in trouble."""
    assert main(["study", str(folder), "--json"]) == 0
    assert trials(folder) == trials(finished)
    assert episodes(folder) == episodes(finished)


@pytest.mark.parametrize("share", [0.0, 0.5, *(pytest.param(one, marks=slow) for one in (0.1, 0.9, 0.999))])
def test_a_write_ahead_log_cut_off_by_a_crash_costs_only_what_was_cut_off(make_study, finished, share):
    """As a machine without power may leave it: what is lost is simulated again, to the same trials."""
    folder, crashed = make_study("half"), make_study("crashed")
    study = open_study(folder)
    with Store.open(folder) as store:
        with pytest.raises(KeyboardInterrupt):
            # Of twenty episodes all is in the log still: SQLite has moved nothing to study.db yet
            run = StudyRun(study, store, Stopping(60 if share else 20))
            check_facts(run)
            run_trials(run, make_proposer("gp", 5))
        for name in ("study.db", "study.db-wal"):
            shutil.copy(folder / name, crashed / name)
    log = crashed / "study.db-wal"
    os.truncate(log, int(share * log.stat().st_size))
    kept = len(episodes(crashed)) if share else 0
    assert (kept > 0) == (share > 0)
    spent, _ = searched(open_study(crashed))
    assert spent.episodes == 7 * 18 - kept
    assert (trials(crashed), episodes(crashed)) == (trials(finished), episodes(finished))


def limited(limit):
    """A process that may write no file larger than this: what a full disk is like, also to root."""
    return {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))}


FULL = r"cannot be read or written \(disk I/O error\); is the disk full\? Everything finished is kept"


@pytest.mark.slow
@pytest.mark.parametrize("limit", [64, 120_000])
def test_a_disk_that_fills_up_is_told_and_the_study_goes_on_when_there_is_room(half, finished, limit):
    before = episodes(half)
    told = run("study", half, status=1, **limited(limit))
    assert re.fullmatch(f"proxytune study: {re.escape(str(half / 'study.db'))}: {FULL}\n", told), told
    assert set(before) <= set(episodes(half))
    goes_on(half, finished)


def drawn(folder):
    """Figures and report, but for its date, and whatever else is in the folder but the database."""
    files = [path for path in folder.rglob("*") if path.is_file() and path.name != "study.db"]
    return {path: re.sub(rb"\d{4}-\d\d-\d\d \d\d:\d\d UTC", b"", path.read_bytes()) for path in files}


@slow
def test_figures_and_report_on_a_full_disk_are_told_and_the_old_ones_stay(finished):
    """The study is finished, its database needs no more room than it has."""
    run("study", finished, "--json")
    before, known = drawn(finished), (trials(finished), episodes(finished))
    for command, limit, name in (("study", 33_500, "figures/convergence.png"), ("plot", 120_000, "report.html")):
        told = run(command, finished, status=1, **limited(limit))
        what = "the figure " if name.endswith("png") else ""
        place = f"{finished / name}: {what}cannot be written (File too large); fix that and run again"
        assert told == f"proxytune {command}: {place}\n"
        assert (trials(finished), episodes(finished)) == known
        assert drawn(finished) == before
    shutil.rmtree(finished / "figures")
    run("plot", finished)
    again = drawn(finished)
    assert {path: again[path] for path in before} == before


@pytest.mark.slow
def test_a_standard_output_that_is_full_is_told(finished):
    with open("/dev/full", "w") as full:
        process = start("plot", finished, "--json", stdout=full)
        _, told = process.communicate(timeout=60)
    line = "standard output: cannot be written (No space left on device); make room and run again"
    assert (process.returncode, told) == (1, f"proxytune plot: {line}\n")


@pytest.fixture
def sealed(half):
    """A half-run study's folder that cannot be written, also not by root: mounted so where the process may."""
    if os.geteuid() != 0:
        half.chmod(0o555)
        yield half, "Permission denied"
        half.chmod(0o755)
        return
    if subprocess.run(["mount", "--bind", half, half], capture_output=True).returncode:
        pytest.skip("root can write every folder, and this process may not mount one that is read-only")
    subprocess.run(["mount", "-o", "remount,ro,bind", half], check=True)
    yield half, "Read-only file system"
    subprocess.run(["umount", half], capture_output=True)


@pytest.mark.slow
def test_a_read_only_folder_is_told_and_the_study_goes_on_where_it_can_be_written(sealed, finished, refused, capsys):
    folder, why = sealed
    before = (folder / "study.db").read_bytes()
    line = f"{folder / 'figures'}: cannot be written there, as {folder} is closed to you; copy the study elsewhere\n"
    assert refused("study", folder) == f"proxytune study: {line}"
    assert refused("study", folder / "study.toml") == f"proxytune study: {line}"
    told = refused("sweep", folder, "--parameter", "trim", "--points", "2")
    assert told == f"proxytune sweep: {line}"
    elsewhere = ("--output", folder.parent / "curves")
    told = refused("sweep", folder, "--parameter", "trim", "--points", "2", *elsewhere, status=1)
    assert told == f"proxytune sweep: {folder}: cannot be written ({why}); copy the study elsewhere\n"
    figure = f"{folder / 'figures' / 'convergence.png'}: the figure cannot be written ({why}); fix that and run again"
    assert refused("plot", folder, status=1) == f"proxytune plot: {figure}\n"
    assert (folder / "study.db").read_bytes() == before
    elsewhere = shutil.copytree(folder, folder.parent / "elsewhere")
    elsewhere.chmod(0o755)
    goes_on(elsewhere, finished)


def test_a_lowered_budget_keeps_what_is_finished_and_says_so(finished, make_study, capsys):
    before = (trials(finished), episodes(finished))
    make_study("study", budget="3")
    assert main(["study", str(finished)]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "ended: the budget of 3 trials is spent; all 7 that are finished count" in out
    assert (trials(finished), episodes(finished)) == before
