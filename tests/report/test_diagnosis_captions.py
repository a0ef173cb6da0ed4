"""Every figure of a diagnosis has a caption."""

import re
from pathlib import Path

import proxytune
from proxytune.report.diagnosis.captions import SAID, pictures

FIGURES = Path(proxytune.__file__).parent / "report" / "diagnosis"


def test_every_figure_that_is_drawn_has_a_title_and_a_caption():
    texts = [(FIGURES / name).read_text(encoding="utf-8") for name in ("figures.py", "camera/figures.py")]
    drawn = {name for text in texts for name in re.findall(r'^        "(\w+)": \w+\(', text, flags=re.M)}
    assert len(drawn) >= 10
    assert drawn == SAID.keys()
    assert all(title and len(caption) > 60 for title, caption in SAID.values())


def test_figures_come_in_one_order_and_an_unknown_one_last():
    names = [one.title for one in pictures({"new": b"", "ranking": b"", "error": b""})]
    assert names == [SAID["error"][0], SAID["ranking"][0], "new"]
