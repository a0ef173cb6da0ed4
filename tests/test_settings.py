"""Settings files are read strictly: each mistake is one line with file, key and remedy."""

import os
from pathlib import Path

import pytest
from one_line import complaint_of

from proxytune.settings import Section, nearest, numbers_in, pairs_in, read_settings, read_text


def section(path, **values):
    return Section(path, "", values)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda s: s.number("a"), "a: is missing; add it"),
        (lambda s: s.number("text"), "text: must be a number, got 'x'"),
        (lambda s: s.number("yes"), "yes: must be a number, got True"),
        (lambda s: s.number("nan"), "nan: must be finite"),
        (lambda s: s.number("n", low=5), "n: must be between 5 and inf, got 3"),
        (lambda s: s.whole("half"), "half: must be a whole number, got 0.5"),
        (lambda s: s.whole("n", high=2), "n: must be between 0 and 2, got 3"),
        (lambda s: s.flag("text", True), "text: must be true or false, without quotes, got 'x'"),
        (lambda s: s.text("n"), "n: must be text in quotes, got 3"),
        (lambda s: s.text("text", choices=("xy", "z")), "text: unknown value 'x'; did you mean 'xy'?"),
        (lambda s: s.texts("n"), "n: must be a list of texts in quotes"),
        (lambda s: s.texts("twice"), "twice: names something twice"),
        (lambda s: s.bounds("reversed"), "reversed: the lower bound must be below the upper one, got [2, 1]"),
        (lambda s: s.bounds("n"), "n: must be [low, high], got 3"),
        (lambda s: s.bounds("open"), "open: bounds must be finite"),
        (lambda s: s.section("n"), "n: must be a table, written [n], got 3"),
        (lambda s: s.only(["text", "number"]), "unknown key"),
    ],
)
def test_a_mistake_names_file_key_and_remedy(tmp_path, call, says):
    values = {"n": 3, "text": "x", "yes": True, "nan": float("nan"), "half": 0.5, "twice": ["a", "a"]}
    values |= {"reversed": [2, 1], "open": [0, float("inf")]}
    told = complaint_of(call, section(tmp_path / "study.toml", **values))
    assert says in told
    assert told.startswith(str(tmp_path / "study.toml"))


def test_good_values_are_taken_as_they_are(tmp_path):
    (tmp_path / "marked.toml").write_bytes(b"\xef\xbb\xbfn = 3\r\n")
    assert read_settings(tmp_path / "marked.toml").whole("n") == 3
    s = section(tmp_path, n=3, x=0.5, t="a", ts=["a", "b"], b=[1, 2.5], deep={"k": 1})
    assert (s.number("n"), s.whole("n"), s.number("x"), s.text("t"), s.texts("ts")) == (3.0, 3, 0.5, "a", ("a", "b"))
    assert s.bounds("b") == (1.0, 2.5)
    assert s.section("deep").whole("k") == 1
    assert (s.flag("yes", True), s.flag("none", False)) == (True, False)
    assert s.section("none").values == {}
    assert (s.number("gone", 2.0), s.text("gone", "d"), s.texts("gone", ("e",))) == (2.0, "d", ("e",))


def test_a_section_reads_like_a_mapping_of_plain_values():
    section = Section(Path("study.toml"), "domain.", {"gain": 2.0, "body": {"mass": 1.0}})
    assert dict(section) == {**section} == dict(section.items()) == section.values
    assert (list(section), len(section), "gain" in section, "mass" in section) == (["gain", "body"], 2, True, False)
    assert (section["body"], section.get("gain"), section.get("mass", 3)) == ({"mass": 1.0}, 2.0, 3)
    assert "study.toml: domain.mass: is missing; add it" in complaint_of(section.__getitem__, "mass")


@pytest.mark.parametrize(
    ("content", "says"),
    [(None, "no such file"), (b"a = [1", "is not valid TOML"), (b"\xff\xfe", "no text in UTF-8")],
)
def test_a_file_that_is_not_toml_is_one_line(tmp_path, content, says):
    path = tmp_path / "study.toml"
    if content is not None:
        path.write_bytes(content)
    assert says in complaint_of(read_settings, path)


def test_a_file_is_looked_for_beside_the_nearest_name_suggested_and_long_rows_are_no_long_keys(tmp_path):
    assert "cannot be read" in complaint_of(read_settings, tmp_path)
    assert pairs_in("--at", " a = 1, b=2,", "NAME=VALUE") == {"a": "1", "b": "2"}
    assert complaint_of(numbers_in, "--at", " ", "NAME=VALUE") == "--at  : write NAME=VALUE"
    assert complaint_of(pairs_in, "--at", "a=1,a=2", "NAME=VALUE") == "--at a=1,a=2: names 'a' twice; give each once"
    section = Section(Path("/some/study.toml"), "", {"target": "../target.csv"})
    assert section.file("target") == Path("/some/../target.csv")
    assert section.file("target", "other.csv") == Path("/some/other.csv")
    assert nearest("trimm", ["trim", "delay"]) == "did you mean 'trim'?"
    assert nearest("foo", ["robot", "trim"]) == "known are: robot, trim"
    assert nearest("zzz", ["trim", "delay"]) == "known are: delay, trim"
    path = tmp_path / "model.toml"
    path.write_text(f"weights = [{', '.join(['0.25'] * 500)}]\nrows = [\n[{', '.join(['0.5'] * 500)}],\n]\n")
    assert len(read_settings(path)["weights"]) == 500


TRAPS = {
    "more digits than Python reads": ("x = " + "9" * 5000, "is not valid TOML: Exceeds the limit"),
    "brackets in brackets": ("x = " + "[" * 20_000, "is nested too deeply"),
    "a key of very many parts": (".".join("a" * 100_000) + " = 1", "a key of more than 100 parts (at line 1)"),
    "a table of very many parts": ("[" + ".".join("a" * 100_000) + "]", "a key of more than 100 parts (at line 1)"),
}


@pytest.mark.parametrize(("text", "says"), TRAPS.values(), ids=TRAPS)
def test_a_trap_in_toml_is_one_line_at_once(write_file, text, says):
    assert says in complaint_of(read_settings, write_file(text, "study.toml"))


LONG = {"long": f"{'a' * 300}.csv", "far": "a/" * 4000}


def test_numbers_too_large_for_a_float_and_texts_that_no_file_can_have_are_refused():
    section = Section(
        Path("study.toml"), "", {"n": 10**400, "pair": [0, 10**400], "name": "a\0b", "names": ["a\0b"], **LONG}
    )
    for read, says in (
        (lambda: section.number("n"), "n: must be finite"),
        (lambda: section.bounds("pair"), "pair: bounds must be finite"),
        (lambda: section.text("name"), "name: must not contain the character NUL"),
        (lambda: section.texts("names"), "names: must not contain the character NUL"),
        (lambda: section.file("long"), "long: no file can have so long a name; shorten it"),
        (lambda: section.file("far"), "far: no file can have so long a name; shorten it"),
    ):
        assert says in complaint_of(read)


def test_devices_and_named_pipes_are_no_files_but_what_a_shell_pipes_in_is(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(OSError, match="a device or a pipe"):
            read_text(path)
    out, into = os.pipe()
    os.write(into, b"x = 1")
    os.close(into)
    assert read_text(Path(f"/dev/fd/{out}")) == "x = 1"
    os.close(out)
    with pytest.raises(OSError, match="null"):
        read_text(tmp_path / "a\0b")
