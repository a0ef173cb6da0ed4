"""Pictures keep their pixels, whatever their encoding, and transforms lead to the robot's pose."""

from io import BytesIO

import bags
import numpy as np
import pytest
from moving_frames import TIMES, circle, moving, read
from PIL import Image

from proxytune.errors import LogError
from proxytune.importing import Wanted, bag_scene as pictures
from proxytune.importing.bag import open_bag
from proxytune.importing.bag_scene import picture_of, read_pictures

PICTURES_TIMES = 1.7e9 + np.arange(3) * 0.1
RGB = np.random.default_rng(0).integers(0, 256, (3, 4, 5, 3)).astype(np.uint8)
OPAQUE = np.full((3, 4, 5, 1), 255, dtype=np.uint8)
ENCODED = {
    "rgb8": RGB,
    "bgr8": RGB[..., ::-1],
    "rgba8": np.concatenate((RGB, OPAQUE), axis=3),
    "bgra8": np.concatenate((RGB[..., ::-1], OPAQUE), axis=3),
}


def written(tmp_path, storage="ros1", **options):
    """A bag of three pictures."""
    return bags.write_messages(tmp_path / "run.bag", storage, bags.picture_messages(PICTURES_TIMES, **options))


def read_of_pictures(path, topic="/camera/image_raw"):
    with open_bag(path) as bag:
        return read_pictures(bag, topic, "header")[0]


@pytest.mark.parametrize("storage", bags.STORAGES)
@pytest.mark.parametrize("pad", [0, 7])
@pytest.mark.parametrize("encoding", ENCODED)
def test_colours_stay_in_place_and_padding_is_left_out(tmp_path, storage, pad, encoding):
    read_back = read_of_pictures(written(tmp_path, storage, pictures=ENCODED[encoding], encoding=encoding, pad=pad))
    assert np.array_equal(np.array(list(read_back.read())), RGB)
    assert read_back.times == pytest.approx(PICTURES_TIMES, abs=1e-6)


def test_grey_is_grey_in_all_colours(tmp_path):
    read_back = read_of_pictures(written(tmp_path, pictures=RGB[..., :1], encoding="mono8"))
    assert np.array_equal(np.array(list(read_back.read())), np.repeat(RGB[..., :1], 3, axis=3))


@pytest.mark.parametrize("form", ["png", "jpeg"])
def test_a_compressed_picture_is_opened(tmp_path, form):
    flat = np.full((4, 5, 3), (200, 40, 90), dtype=np.uint8)
    file = BytesIO()
    Image.fromarray(flat).save(file, form, **({"quality": 100, "subsampling": 0} if form == "jpeg" else {}))
    (picture,) = read_of_pictures(compressed(tmp_path, file.getvalue(), form), "/camera").read()
    assert np.abs(picture.astype(int) - flat).max() <= (2 if form == "jpeg" else 0)


def compressed(tmp_path, data, form):
    fields = {"header": bags.header(PICTURES_TIMES[0]), "format": form, "data": np.frombuffer(data, dtype=np.uint8)}
    message = ("/camera", "sensor_msgs/msg/CompressedImage", PICTURES_TIMES[0], fields)
    return bags.write_messages(tmp_path / "run.bag", "ros1", [message])


def test_a_compressed_picture_that_is_damaged_is_told_by_number(tmp_path):
    file = BytesIO()
    Image.fromarray(RGB[0]).save(file, "png")
    for data in (b"", b"no picture", file.getvalue()[:60]):
        (tmp_path / f"{len(data)}").mkdir()
        damaged = read_of_pictures(compressed(tmp_path / f"{len(data)}", data, "png"), "/camera")
        with pytest.raises(LogError, match=r"run.bag: /camera, message 1: is no picture .*'png'.* --pictures none"):
            list(damaged.read())


def test_a_picture_of_16_bits_is_refused(tmp_path):
    file = BytesIO()
    Image.fromarray(np.ones((4, 5), dtype=np.uint16)).save(file, "png")
    with pytest.raises(LogError, match="/camera, message 1: has more than 8 bits a pixel"):
        list(read_of_pictures(compressed(tmp_path, file.getvalue(), "png"), "/camera").read())


def test_an_unknown_encoding_is_told_before_anything_is_made(tmp_path):
    bag = written(tmp_path, pictures=RGB, encoding="bayer_rggb8")
    with pytest.raises(LogError, match="message 1: encoding 'bayer_rggb8' is none of rgb8, .* --pictures none"):
        read_of_pictures(bag)


@pytest.mark.parametrize("change", [{"step": 14}, {"height": 5}])
def test_too_few_bytes_are_told(tmp_path, change):
    messages = [(*rest, fields | change) for *rest, fields in bags.picture_messages(PICTURES_TIMES, RGB)]
    bag = bags.write_messages(tmp_path / "run.bag", "ros1", messages)
    with pytest.raises(LogError, match="message 1: 60 bytes do not hold 5 × . pixels"):
        read_of_pictures(bag)


def test_pictures_are_made_one_at_a_time_and_anew_each_time(tmp_path, monkeypatch):
    made = []
    monkeypatch.setattr(pictures, "picture_of", lambda message: made.append(message) or picture_of(message))
    read_back = read_of_pictures(written(tmp_path, pictures=RGB))
    assert not made
    next(read_back.read())
    assert len(made) == 1
    assert len(list(read_back.read())) == 3


@pytest.mark.parametrize(
    ("fixed", "pair", "taken"),
    [
        (("map", "r1/odom", [(5.0, 0.0, 0.0)]), ("r1/odom", "r1/base_link"), "r1/base_link in map"),
        (("map", "dock/base_link", [(1.0, 0.0, 0.0)]), ("odom", "base_link"), "base_link in odom"),
        (None, ("stage", "robot7"), "robot7 in stage"),
    ],
)
def test_a_pair_that_moves_is_taken_map_before_odom_in_any_namespace(tmp_path, fixed, pair, taken):
    still = [moving(*fixed, TIMES[:1], "/tf_static")] if fixed else []
    source = read(tmp_path, *still, moving(*pair, circle()))
    assert any(note.startswith(f"Poses of {taken} are") for note in source.notes)


@pytest.mark.parametrize(
    ("poses", "words"),
    [
        ("", r"run: /tf: no transform is plainly .*; the bag has stage>a, stage>b, b>c \(static\)"),
        ("stage>d", "no transforms lead from 'stage' to 'd'; name a parent and a child by --poses"),
        ("a>stage", "no transforms lead from 'a' to 'stage'"),
        ("b>c", "b>c never moves"),
    ],
)
def test_no_plain_pose_is_told_with_what_there_is(tmp_path, poses, words):
    one, other = moving("stage", "a", circle()), moving("stage", "b", circle(), TIMES + 0.01)
    static = moving("b", "c", [(0.0, 0.0, 0.0)], TIMES[:1] + 1, "/tf_static")
    with pytest.raises(LogError, match=words):
        read(tmp_path, one, other, static, wanted=Wanted(commands="none", poses=poses))


def test_transforms_in_a_circle_end_and_a_static_one_published_again_replaces_the_first(tmp_path):
    with pytest.raises(LogError, match="no transforms lead from 'c' to 'a'"):
        wanted = Wanted(commands="none", poses="c>a")
        read(tmp_path, moving("b", "a", circle()), moving("a", "b", circle()), wanted=wanted)
    world = moving("map", "odom", [(7.0, 0.0, 0.0), (10.0, 0.0, 0.0)], TIMES[[0, 30]], "/tf_static")
    poses = read(tmp_path / "again", world, moving("odom", "base_link", circle())).drives[0].poses
    assert poses.places[:, 0] == pytest.approx(10.0 + circle()[:, 0])
