"""What is in the cache is whole, is made once, and is told apart by all that determines it."""

import contextlib
import zipfile

import numpy as np
import pytest

from proxytune.errors import StoreError
from proxytune.learning.cache import Cache, digest


def test_arrays_are_made_once_and_read_back_to_the_last_bit(tmp_path):
    cache, made = Cache(tmp_path / "kept"), []

    def make():
        made.append(1)
        return {"values": np.random.default_rng(3).normal(size=(4, 2)), "small": np.arange(3, dtype=np.uint8)}

    first, again = (cache.get("samples", {"seed": 1}, make) for _ in range(2))
    assert len(made) == 1
    assert set(first) == {"values", "small"}
    assert all(np.array_equal(first[name], again[name]) and first[name].dtype == again[name].dtype for name in first)
    assert np.array_equal(first["values"], np.random.default_rng(3).normal(size=(4, 2)))


def test_other_facts_are_other_arrays_and_the_order_of_facts_is_none():
    assert digest({"a": 1, "b": 2.0}) == digest({"b": 2.0, "a": 1})
    assert len({digest({"a": value}) for value in (1, 2, 1.5, "1", None)}) == 5


def test_the_file_says_what_determines_it(tmp_path):
    cache = Cache(tmp_path)
    cache.get("exam", {"seed": 7, "theta": {"trim": 0.1}}, lambda: {"scores": np.zeros(2)})
    with np.load(cache.path("exam", {"theta": {"trim": 0.1}, "seed": 7})) as file:
        assert str(file["facts"]) == '{"seed": 7, "theta": {"trim": 0.1}}'


def test_what_failed_while_being_made_is_not_there(tmp_path):
    cache = Cache(tmp_path)
    with pytest.raises(ZeroDivisionError):
        cache.get("exam", {"seed": 1}, lambda: 1 / 0)
    assert not cache.has("exam", {"seed": 1})


@pytest.mark.parametrize("keep", [0, 10, 200])
def test_a_damaged_file_is_one_line_with_a_remedy(tmp_path, keep):
    cache, facts = Cache(tmp_path), {"seed": 1}
    cache.get("exam", facts, lambda: {"scores": np.zeros(200)})
    path = cache.path("exam", facts)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(StoreError, match="is damaged .*delete it, and run again"):
        cache.get("exam", facts, dict)


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "kept").write_text("a file, where the folder should be")
    with pytest.raises(StoreError, match="cannot be written"):
        Cache(tmp_path / "kept").get("exam", {}, lambda: {"scores": np.zeros(1)})


@pytest.mark.parametrize("place", [0.3, 0.5, 0.7, 0.9])
def test_a_flipped_byte_is_one_line_or_in_no_array(tmp_path, place):
    cache, facts = Cache(tmp_path), {"seed": 1}
    noise = {"scores": np.random.default_rng(1).normal(size=500)}
    cache.get("exam", facts, lambda: noise)
    path = cache.path("exam", facts)
    content = bytearray(path.read_bytes())
    content[int(place * len(content))] ^= 0xFF
    path.write_bytes(content)
    with contextlib.suppress(StoreError):
        assert (cache.get("exam", facts, dict)["scores"] == noise["scores"]).all()


def test_an_array_of_impossible_size_is_damage(tmp_path):
    cache, facts = Cache(tmp_path), {"seed": 1}
    path = cache.path("exam", facts)
    header = repr({"descr": "<f8", "fortran_order": False, "shape": (10**12,)}).encode().ljust(117) + b"\n"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("scores.npy", b"\x93NUMPY\x01\x00v\x00" + header)
    with pytest.raises(StoreError, match="is damaged .*delete it"):
        cache.get("exam", facts, dict)
