"""What is packed is measured before it is unpacked, and what raises a limit is told."""

import io
import tracemalloc

import numpy as np
import pytest
from PIL import Image

from proxytune import unpacking
from proxytune.errors import InputError
from proxytune.settings import LARGEST
from proxytune.unpacking import check_unpacked, open_picture, read_arrays


def test_arrays_are_measured_before_they_are_unpacked(tmp_path, monkeypatch):
    np.savez_compressed(tmp_path / "bomb.npz", a=np.zeros(2**20), b=np.zeros(2**20))
    tracemalloc.start()
    with pytest.raises(InputError, match=rf"bomb.npz: unpacks to 17 MB or more, of 10 MB.*{LARGEST}=17"):
        read_arrays(tmp_path / "bomb.npz", 10)
    assert tracemalloc.get_traced_memory()[1] < 2**20
    tracemalloc.stop()
    monkeypatch.setenv(LARGEST, "17")
    assert set(read_arrays(tmp_path / "bomb.npz", 10)) == {"a", "b"}


def test_a_picture_is_measured_before_it_is_unpacked(monkeypatch):
    packed = io.BytesIO()
    Image.new("1", (13000, 13000)).save(packed, "PNG")
    with (
        pytest.raises(InputError, match="x: a picture of 13000 × 13000: unpacks to 507 MB or more, of 200 MB at most"),
        open_picture(packed, "x", ("PNG",)),
    ):
        pass
    monkeypatch.setenv(LARGEST, "600")
    with open_picture(packed, "x", ("PNG",)) as image:
        assert image.size == (13000, 13000)


def test_a_limit_that_is_no_number_is_told(monkeypatch):
    monkeypatch.setenv(LARGEST, "much")
    with pytest.raises(InputError, match=f"{LARGEST}=much: must be a number of megabytes"):
        check_unpacked("x", 1.0, unpacking.ARRAYS_MB)
