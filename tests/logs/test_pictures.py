"""Pictures of any size and kind are read as red, green and blue, averaged down, one after another."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from proxytune.errors import LogError
from proxytune.logs import Frames, read_log
from proxytune.logs.pictures import read_pictures

DATA = Path(__file__).resolve().parents[2] / "../shared/data/logs/gym_duckietown_frames"
SMOOTH = np.stack(np.meshgrid(np.linspace(20, 230, 640), np.linspace(40, 200, 480)), axis=-1).astype(np.uint8)
LARGE = np.concatenate((SMOOTH, 255 - SMOOTH[..., :1]), axis=-1)


@pytest.fixture
def frames_of(tmp_path):
    def write(*images, ending="png", **options):
        paths = tuple(tmp_path / f"{number}.{ending}" for number in range(len(images)))
        for path, image in zip(paths, images, strict=True):
            (image if isinstance(image, Image.Image) else Image.fromarray(image)).save(path, **options)
        return Frames(paths, np.zeros(len(paths), dtype=np.int64), np.arange(float(len(paths))), "small_loop")

    return write


def complaint(frames, numbers=(0,)):
    with pytest.raises(LogError) as caught:
        read_pictures(frames, numbers)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def noise(rows, columns, seed=5):
    return np.random.default_rng((seed, rows, columns)).integers(0, 256, (rows, columns, 3), dtype=np.uint8)


def test_a_picture_that_is_not_too_wide_stays_as_it_is(frames_of):
    picture = noise(90, 120)
    pictures = read_pictures(frames_of(picture), [0])
    assert pictures.dtype == np.uint8
    np.testing.assert_array_equal(pictures, picture[None])


def test_every_pixel_of_a_wider_picture_counts_alike(frames_of):
    picture = noise(480, 640)
    mean = picture.reshape(120, 4, 160, 4, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(read_pictures(frames_of(picture), [0])[0], mean, atol=1.01)


@settings(derandomize=True, deadline=None, max_examples=20)
@given(rows=st.integers(1, 300), columns=st.integers(161, 500))
def test_a_width_that_is_no_multiple_is_averaged_all_the_same(tmp_path_factory, rows, columns):
    path, picture = tmp_path_factory.mktemp("odd") / "0.png", noise(rows, columns)
    Image.fromarray(picture).save(path)
    frames = Frames((path,), np.zeros(1, dtype=np.int64), np.zeros(1), "small_loop")
    (small,) = read_pictures(frames, [0])
    assert small.shape == (max(1, round(rows * 160 / columns)), 160, 3)
    np.testing.assert_allclose(small.mean(axis=(0, 1)), picture.mean(axis=(0, 1)), atol=1.0)


@pytest.mark.parametrize("quality", [95, 70])
def test_a_jpeg_is_averaged_like_the_picture_that_it_was(frames_of, quality):
    (small,) = read_pictures(frames_of(LARGE, ending="jpg", quality=quality), [0])
    exact = LARGE.reshape(120, 4, 160, 4, 3).mean(axis=(1, 3))
    assert small.shape == (120, 160, 3)
    assert np.abs(small - exact).max() < 6.0


@pytest.mark.parametrize(("mode", "ending"), [("L", "png"), ("L", "jpg"), ("RGBA", "png"), ("P", "png"), ("1", "png")])
def test_pictures_of_other_kinds_become_red_green_and_blue(frames_of, mode, ending):
    image = Image.fromarray(LARGE).convert(mode)
    expected = np.asarray(image.convert("RGB")).reshape(120, 4, 160, 4, 3).mean(axis=(1, 3))
    (small,) = read_pictures(frames_of(image, ending=ending), [0])
    np.testing.assert_allclose(small, expected, atol=4.0)


def test_some_of_the_pictures_are_read_in_the_order_asked_for(frames_of):
    first, second, third = (noise(12, 16, seed) for seed in range(3))
    frames = frames_of(first, second, third)
    np.testing.assert_array_equal(read_pictures(frames, [2, 0]), [third, first])
    assert len(read_pictures(frames, [])) == 0


def test_pictures_of_two_sizes_are_refused_with_both(frames_of):
    says = complaint(frames_of(noise(12, 16), noise(12, 16), noise(12, 20)), [0, 1, 2])
    assert says.endswith("2.png: is 20 × 12, but 0.png is 16 × 12; give all pictures one size")


def test_sixteen_bits_a_pixel_are_refused(frames_of):
    assert "more than 8 bits a pixel" in complaint(
        frames_of(Image.fromarray(np.full((12, 16), 40000, dtype=np.uint16)))
    )


def test_a_picture_that_is_gone_is_named(frames_of):
    frames = frames_of(noise(12, 16))
    frames.paths[0].unlink()
    assert complaint(frames) == f"{frames.paths[0]}: no such file; add the picture"


@settings(derandomize=True, deadline=None, max_examples=150)
@given(data=st.data(), ending=st.sampled_from(["png", "jpg"]))
def test_a_damaged_file_is_one_line_or_another_picture(tmp_path_factory, data, ending):
    path = tmp_path_factory.getbasetemp() / f"damaged.{ending}"
    Image.fromarray(LARGE[:40:2, :40:2]).save(path)
    whole = path.read_bytes()
    cut = data.draw(st.integers(0, len(whole)), "cut")
    place, byte = data.draw(st.integers(0, len(whole) - 1), "place"), data.draw(st.integers(0, 255), "byte")
    path.write_bytes((whole[:place] + bytes([byte]) + whole[place + 1 :])[:cut])
    frames = Frames((path,), np.zeros(1, dtype=np.int64), np.zeros(1), "small_loop")
    shape, problem = read(frames)
    assert shape[3:] == (3,) or problem.startswith(f"{path}: ")
    assert "\n" not in problem


def read(frames):
    """Shape of the first picture, or () and what is wrong with it."""
    try:
        return read_pictures(frames, [0]).shape, ""
    except LogError as problem:
        return (), str(problem)


@pytest.mark.parametrize("ending", ["png", "jpg"])
def test_a_picture_that_is_cut_off_is_refused(frames_of, ending):
    frames = frames_of(LARGE, ending=ending)
    frames.paths[0].write_bytes(frames.paths[0].read_bytes()[:2000])
    assert complaint(frames).endswith(
        f"0.{ending}: is not a whole PNG or JPEG picture; save it again or leave its frame out"
    )


@pytest.mark.skipif(not DATA.is_dir(), reason="needs measured data in shared/data/logs")
def test_the_measured_pictures_are_read_as_they_are():
    pictures = read_pictures(read_log(DATA).frames, range(120))
    assert pictures.shape == (120, 120, 160, 3)
    with Image.open(DATA / "frames" / "0119.png") as last:
        np.testing.assert_array_equal(pictures[119], np.asarray(last.convert("RGB")))
