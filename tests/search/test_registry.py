import builtins
import importlib.util
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from one_line import complaint_of
from steps import SPACE, WHOLE, lacking, search, steps

from proxytune.errors import InputError, to_install
from proxytune.search import ENGINE_NAMES, ENGINES, Trial, code_of, registry
from proxytune.search.engine import AfterDesign, design_point
from proxytune.search.registry import engine_code, engine_of, make_proposer, why_not
from proxytune.testing.extension import check_engine


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A room of four modules: a imports b, and c within a function; d stands alone."""
    (tmp_path / "search").mkdir()
    (tmp_path / "search" / "a.py").write_text(
        "import numpy\nfrom proxytune.search.b import x\n\ndef f():\n    from proxytune.search import c\n"
    )
    for name in "bcd":
        (tmp_path / "search" / f"{name}.py").write_text("x = 1\n")
    monkeypatch.setattr(registry, "FOLDER", tmp_path)
    code_of.cache_clear()
    yield tmp_path
    code_of.cache_clear()


def edited(path):
    before = code_of("proxytune.search.a")
    path.write_text(path.read_text() + "y = 2\n")
    code_of.cache_clear()
    return code_of("proxytune.search.a") != before


@pytest.mark.parametrize("name", "abcd")
def test_an_edit_of_what_a_module_imports_anywhere_and_of_nothing_else_changes_its_digest(folder, name):
    assert edited(folder / "search" / f"{name}.py") == (name != "d")


def test_a_comment_changes_no_digest(folder):
    before, path = code_of("proxytune.search.a"), folder / "search" / "b.py"
    path.write_text(f"# edited\n{path.read_text()}")
    code_of.cache_clear()
    assert code_of("proxytune.search.a") == before


def test_modules_that_import_each_other_have_a_digest(folder):
    (folder / "search" / "b.py").write_text("from proxytune.search.a import f\n")
    assert code_of("proxytune.search.a") == code_of("proxytune.search.b", "proxytune.search.a")


def test_studies_of_one_engine_outlast_an_edit_of_another_engine(tmp_path, monkeypatch):
    shutil.copytree(registry.FOLDER / "search", tmp_path / "search")
    monkeypatch.setattr(registry, "FOLDER", tmp_path)
    code_of.cache_clear()
    before = {engine: engine_code(engine) for engine in ("outcomes", "gp", "tpe", "random")}
    with (tmp_path / "search" / "likelihood.py").open("a") as file:
        file.write("EDITED = 1\n")
    code_of.cache_clear()
    changed = {engine for engine, code in before.items() if engine_code(engine) != code}
    code_of.cache_clear()
    assert changed == {"outcomes"}


FAKES = Path(__file__).parent.parent / "fakes"
HAS_OPTUNA = importlib.util.find_spec("optuna") is not None
LONG = ("gp", "composite")
HERE = [pytest.param(e, marks=[pytest.mark.skipif(bool(lacking(e)), reason=lacking(e))]) for e in ENGINE_NAMES]


def made(engine, initial):
    return make_proposer(engine, initial, WHOLE)


@pytest.mark.parametrize("engine", HERE)
def test_every_engine_begins_with_the_same_design_and_proposes_what_is_new_by_its_seed(engine):
    trials = search(made(engine, 4), 4, seed=9)
    assert [trial.values for trial in trials] == [design_point(SPACE, index, 9) for index in range(4)]
    # Also where the best is at a corner of the box.
    trials = search(made(engine, 3), 8, seed=1, score=lambda values: -100 * values[0] - values[1])
    assert len({trial.values for trial in trials}) == 8
    told = [Trial(design_point(SPACE, index, 1), float(index), (float(index),)) for index in range(3)]
    proposer = made(engine, 3)
    assert proposer.propose(SPACE, told, 1) != proposer.propose(SPACE, told, 2)


@pytest.mark.parametrize(
    "engine",
    [pytest.param(*one.values, marks=[*one.marks, *[pytest.mark.slow] * (one.values[0] in LONG)]) for one in HERE],
)
def test_every_engine_keeps_what_engines_promise(engine):
    check_engine(engine_of(engine))


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "count"), [("gp", 8), ("composite", 8), ("outcomes", 8), ("outcomes", 9)])
def test_in_another_process_with_other_threads_and_trials_in_another_order_the_same_bits_are_proposed(engine, count):
    trials = search(made(engine, 5), count, seed=4)
    code = (
        f"import sys; sys.path.append({str(FAKES)!r})\n"
        "from steps import WHOLE\n"
        "from proxytune.search import Trial, make_proposer\n"
        "from proxytune.space import Interval, Space\n"
        f"print(repr(make_proposer({engine!r}, 5, WHOLE).propose({SPACE!r}, {trials[::-1]!r}, 4)))"
    )
    environment = {**os.environ, "OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2", "PYTHONHASHSEED": "7"}
    found = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == repr(made(engine, 5).propose(SPACE, trials, 4))


@pytest.mark.parametrize("engine", [pytest.param("gp", marks=pytest.mark.slow), "composite"])
def test_a_failed_trial_keeps_the_search_away(engine):
    """Everything beyond 0.15 s fails; the search goes there less than the design would."""
    trials = search(made(engine, 6), 20, seed=1, score=lambda v: None if v[0] > 0.15 else steps(v))
    assert sum(trial.values[0] > 0.15 for trial in trials[6:]) < 14 / 3


@pytest.mark.parametrize("engine", ["composite", "outcomes"])
def test_where_a_score_has_no_parts_an_engine_of_outcomes_is_refused(engine):
    with pytest.raises(InputError, match=f"'{engine}' models what a score is computed from"):
        make_proposer(engine, 3)


def test_an_engine_is_told_of_a_failed_trial_as_the_worst_and_only_after_the_design():
    class Listening:
        told = None

        def propose(self, space, trials, seed):
            self.told = [trial.score for trial in trials]
            return (0.1, 0.1)

    inner = Listening()
    trials = [Trial((0.1, 0.0), 3.0), Trial((0.2, 0.0), None), Trial((0.3, 0.0), 8.0)]
    AfterDesign(inner, 4).propose(SPACE, trials, 1)
    assert inner.told is None
    AfterDesign(inner, 3).propose(SPACE, trials, 1)
    assert inner.told == [3.0, 8.0, 8.0]


@pytest.mark.skipif(not HAS_OPTUNA, reason="Optuna is not installed")
def test_tpe_learns_from_the_scores_and_says_nothing(capfd):
    low, high = (search(make_proposer("tpe", 4), 12, 1, score) for score in (steps, lambda v: -steps(v)))
    assert np.mean([steps(trial.values) for trial in low[4:]]) < np.mean([steps(trial.values) for trial in high[4:]])
    assert capfd.readouterr() == ("", "")


NEEDY = [engine.name for engine in ENGINES if engine.needs]
NEED = {"tpe": "'tpe' needs Optuna, which is not installed; " + to_install("tpe")}


@pytest.mark.parametrize("engine", NEEDY)
def test_an_engine_whose_library_is_missing_is_refused_in_one_line_with_what_to_do(engine, monkeypatch):
    monkeypatch.setattr(registry, "find_spec", lambda name: None)
    assert complaint_of(make_proposer, engine, 3).startswith(NEED[engine])


def test_no_other_engine_needs_these_libraries(monkeypatch):
    whole = builtins.__import__

    def without(name, *arguments, **more):
        if name.split(".")[0] in ("optuna", "torch", "botorch", "gpytorch"):
            raise ModuleNotFoundError(name)
        return whole(name, *arguments, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    told = [Trial(design_point(SPACE, index, 1), float(index), (float(index),)) for index in range(3)]
    for engine in ENGINE_NAMES:
        if engine not in NEEDY:
            assert len(made(engine, 3).propose(SPACE, told, 1)) == 2


def test_every_engine_not_refused_can_be_made_by_code_of_its_own_and_random_and_sobol_learn_nothing():
    digests = [engine_code(engine) for engine in ENGINE_NAMES]
    assert len(set(digests)) == len(set(ENGINE_NAMES)) == len(ENGINES)
    assert [engine_of(name) for name in ENGINE_NAMES] == list(ENGINES)
    for engine in ENGINE_NAMES:
        if not why_not(engine, composed=True):
            assert made(engine, 3).initial == 3
    for engine in ("random", "sobol"):
        low, high = (search(made(engine, 2), 6, 1, score) for score in (steps, lambda values: 100.0))
        assert [trial.values for trial in low] == [trial.values for trial in high]
    told = complaint_of(make_proposer, "sobool", 3)
    assert "unknown engine 'sobool' (your own is written module:attribute); did you mean 'sobol'" in told


def test_an_engine_in_a_file_of_ones_own_is_found_beside_and_goes_by_the_name_it_was_asked_for(tmp_path):
    (tmp_path / "mine.py").write_text("from proxytune.search.engine import SOBOL as ENGINE\nNONE = 3\n")
    assert engine_of("mine:ENGINE", tmp_path) == replace(engine_of("sobol"), name="mine:ENGINE")
    assert "engine 'mine:NONE' is a int; make it a proxytune" in complaint_of(engine_of, "mine:NONE", tmp_path)
    assert "engine 'nowhere:ENGINE': no module 'nowhere' installed" in complaint_of(engine_of, "nowhere:ENGINE")


def test_the_code_of_ones_own_engine_is_part_of_what_its_runs_depend_on(tmp_path):
    head = "from proxytune.search import Engine\n"
    text = f"{head}class Mine:\n    step = 1\nENGINE = Engine('m', '', '', Mine)\n"
    other, codes = text.replace("step = 1", "step = 2"), []
    for place, source in (("one", text), ("same", f"# a comment\n{text}"), ("other", other)):
        (tmp_path / place).mkdir()
        (tmp_path / place / "mine.py").write_text(source)
        codes.append(engine_code(engine_of("mine:ENGINE", tmp_path / place)))
    assert codes[0] == codes[1] != codes[2]
