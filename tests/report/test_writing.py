import os
import re

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from proxytune.errors import RunError
from proxytune.report.writing import figures_also_as, save_figure, svg_of, write_picture, write_text


@pytest.fixture
def figure():
    made = Figure(figsize=(2.0, 1.5))
    made.subplots().plot([0, 1], label="θ")
    made.legend()
    return made


def test_a_figure_is_a_png_and_what_is_asked_for_the_same_each_time_with_fonts_that_journals_take(figure, tmp_path):
    save_figure(figure, tmp_path / "sweep_trim_delay=0.1.png")
    assert [path.name for path in tmp_path.iterdir()] == ["sweep_trim_delay=0.1.png"]
    plain = (tmp_path / "sweep_trim_delay=0.1.png").read_bytes()
    with figures_also_as(("svg", "pdf")):
        save_figure(figure, tmp_path / "sweep_trim_delay=0.1.png")
    begins = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}
    assert {path.suffix: path.read_bytes()[:4] for path in tmp_path.iterdir()} == {
        ending: first[:4] for ending, first in begins.items()
    }
    assert (tmp_path / "sweep_trim_delay=0.1.png").read_bytes() == plain
    (tmp_path / "other").mkdir()
    save_figure(figure, tmp_path / "other" / "plain.png")
    assert len(list((tmp_path / "other").iterdir())) == 1
    with figures_also_as(("svg", "pdf")):
        save_figure(figure, tmp_path / "one.png")
        save_figure(figure, tmp_path / "two.png")
    for ending in ("png", "svg", "pdf"):
        assert (tmp_path / f"one.{ending}").read_bytes() == (tmp_path / f"two.{ending}").read_bytes()
    assert b"/Type3" not in (tmp_path / "one.pdf").read_bytes()
    assert b"Date" not in (tmp_path / "one.pdf").read_bytes()


PICTURE = np.random.default_rng(1).integers(0, 256, (6, 8, 3), dtype=np.uint8)


def test_texts_and_pictures_are_on_disk_as_they_are_before_they_have_their_names(tmp_path, monkeypatch):
    write_text(tmp_path / "new" / "report.html", "θ\n")
    write_picture(tmp_path / "new" / "000001.png", PICTURE)
    assert (tmp_path / "new" / "report.html").read_bytes() == "θ\n".encode()
    with Image.open(tmp_path / "new" / "000001.png") as written:
        np.testing.assert_array_equal(np.asarray(written), PICTURE)
    assert {path.name for path in (tmp_path / "new").iterdir()} == {"report.html", "000001.png"}
    path, steps = tmp_path / "page.html", []
    monkeypatch.setattr(os, "fsync", lambda descriptor: steps.append((os.fstat(descriptor).st_size, path.exists())))
    write_text(path, "new")
    assert steps == [(3, False)]


WRITTEN = {
    "": lambda path, figure: write_text(path, "new"),
    "the picture ": lambda path, figure: write_picture(path, PICTURE),
    "the figure ": lambda path, figure: save_figure(figure, path),
}


@pytest.mark.parametrize("what", WRITTEN)
def test_a_failed_write_keeps_the_old_file_and_is_told_in_one_line(figure, tmp_path, write_file, monkeypatch, what):
    path = write_file("old", "file")

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(RunError, match=rf"file: {what}cannot be written \(No space left on device\)"):
        WRITTEN[what](path, figure)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_powers_of_ten_at_an_axis_are_formulas_and_a_dollar_in_a_name_is_none():
    """What Matplotlib writes at ticks is never shown as its source, on a page or in a file."""
    made = Figure(figsize=(2.0, 1.5))
    axes = made.subplots()
    axes.plot([1, 1000], [0, 1])
    axes.set_xscale("symlog")
    axes.set_title("$a$ and $b$")
    with mpl.rc_context({"svg.fonttype": "none"}):
        svg_of(made)  # tick labels have their texts from the first drawing on
        drawn = svg_of(made).decode("utf-8")
    assert "mathdefault" not in re.sub("<!--.*?-->", "", drawn)
    assert "$a$ and $b$" in drawn
