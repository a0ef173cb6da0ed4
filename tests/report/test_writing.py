import numpy as np
import pytest
from PIL import Image

from proxytune.errors import RunError
from proxytune.report.writing import write_picture, write_text


def test_a_text_is_written_with_its_folder_and_nothing_beside_it(tmp_path):
    write_text(tmp_path / "new" / "report.html", "θ\n")
    assert (tmp_path / "new" / "report.html").read_bytes() == "θ\n".encode()
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["report.html"]


def test_a_failed_write_keeps_the_old_file_and_is_told_in_one_line(tmp_path, monkeypatch):
    path = tmp_path / "report.html"
    path.write_text("old")

    def full(self, text, **how):
        with self.open("w") as draft:
            draft.write(text[:1])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_text", full)
    with pytest.raises(RunError, match=r"report\.html: cannot be written \(No space left on device\)"):
        write_text(path, "new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_picture_is_written_as_it_is_with_its_folder_and_nothing_beside_it(tmp_path):
    picture = np.random.default_rng(1).integers(0, 256, (6, 8, 3), dtype=np.uint8)
    write_picture(tmp_path / "new" / "000001.png", picture)
    with Image.open(tmp_path / "new" / "000001.png") as written:
        np.testing.assert_array_equal(np.asarray(written), picture)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["000001.png"]


def test_a_failed_picture_keeps_the_old_file_and_is_told_in_one_line(tmp_path, monkeypatch):
    path = tmp_path / "000001.png"
    path.write_text("old")

    def full(self, draft, **how):
        draft.write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Image.Image, "save", full)
    with pytest.raises(RunError, match=r"000001\.png: the picture cannot be written \(No space left on device\)"):
        write_picture(path, np.zeros((6, 8, 3), dtype=np.uint8))
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
