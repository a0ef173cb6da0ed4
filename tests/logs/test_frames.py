"""A log's frames are read with their drives and times, and every complaint says where and what to do."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings, strategies as st
from log_folders import complaint, write_files
from one_line import complaint_of
from PIL import ExifTags, Image
from PIL.PngImagePlugin import PngInfo

from proxytune.api import log_of
from proxytune.logs import Frames, read_log, read_pictures

BASE = 'format = 1\nrobot = "tractor"\ncommand = "twist"\nrate_hz = 10\n'
TOML = BASE + 'map = "small_loop"\n' + '[camera]\nframes = "frames/%04d.jpg"\n'
SAMPLES = "episode,time,v,omega,x,y,heading\n" + "".join(f"a,{5 + k / 10},0,0,{k},0,0\n" for k in range(4))
SAMPLES += "b,0,0,0,,,\nb,0.1,0,0,0,0,0\nb,0.3,0,0,0,0,0\n"
HEADER = "frame,episode,time\n"
LISTED = HEADER + "7,a,5.013\n9,a,5.3\n8,b,0.2\n"


@pytest.fixture
def folder(tmp_path):
    def write(frames=LISTED, description=TOML, pictures=range(7, 10), samples=SAMPLES, ending="jpg"):
        files = {"log.toml": description, "samples.csv": samples}
        home = write_files(tmp_path / "log", files if frames is None else files | {"frames.csv": frames})
        (home / "frames").mkdir(exist_ok=True)
        for number in pictures:
            (home / "frames" / f"{number:04d}.{ending}").touch()
        return home

    return write


def test_frames_have_their_own_times_and_numbers(folder):
    frames = read_log(folder()).frames
    assert [path.name for path in frames.paths] == ["0007.jpg", "0009.jpg", "0008.jpg"]
    assert frames.drives.tolist() == [0, 0, 1]
    assert frames.times.tolist() == [5.013, 5.3, 0.2]
    assert (frames.road, frames.position_m, frames.heading_deg) == ("small_loop", None, None)
    assert (frames.rectified, frames.readout_s, frames.fixed_exposure) == (False, None, False)


def test_a_frame_of_a_row_has_the_time_at_which_the_pose_lies_on_the_grid(folder):
    log = read_log(folder(None, pictures=range(7), samples=SAMPLES.replace("a,5.1,", "a,5.12,")))
    assert log.frames.times[1] == log.episodes[0].times[1] == pytest.approx(5.1)


def test_what_is_stated_of_the_camera_and_its_map_is_kept(folder):
    stated = 'poses = { position_m = 0.005, heading_deg = 1.0 }\nexposure = "fixed"\nrectified = true\n'
    frames = read_log(folder(description=TOML + stated + 'shutter = "rolling"\nreadout_s = 0.02\n')).frames
    assert (frames.position_m, frames.heading_deg, frames.readout_s) == (0.005, 1.0, 0.02)
    assert frames.rectified
    assert frames.fixed_exposure
    home = folder(description=TOML.replace("small_loop", "yard.toml"))
    assert complaint(home) == "/log.toml: map: no such file: yard.toml; add it beside log.toml"
    (home / "yard.toml").touch()
    assert read_log(home).frames.road == str((home / "yard.toml").resolve())


@pytest.mark.parametrize(
    ("stated", "readout"),
    [('shutter = "global"\n', 0.0), ('shutter = "rolling"\n', None), ("readout_s = 0.01\n", 0.01), ("", None)],
)
def test_a_global_shutter_takes_no_time_and_an_unstated_one_is_not_known(folder, stated, readout):
    assert read_log(folder(description=TOML + stated)).frames.readout_s == readout


def test_frames_out_of_the_poses_time_are_left_out_or_refused(folder):
    listed = HEADER + "7,a,4.9\n8,a,5.0\n9,a,5.4\n10,b,0.0\n11,b,0.1\n12,b,9\n"
    frames = read_log(folder(listed, pictures=(8, 11))).frames
    assert [path.name for path in frames.paths] == ["0008.jpg", "0011.jpg"]
    assert frames.times.tolist() == [5.0, 0.1]
    says = complaint(folder(HEADER + "7,a,1700000000\n8,a,1700000001\n"))
    assert says.startswith("/frames.csv: line 2, column 'time': no frame lies within its episode's poses: ")
    assert "the first of 'a' is at 1700000000 s, its poses between 5 and 5.3 s; write both in seconds" in says
    nowhere = "episode,time,v,omega,x,y,heading\na,5,0,0,,,\na,5.1,0,0,,,\nb,0,0,0,,,\nb,0.1,0,0,,,\n"
    assert "the first of 'a' is at 5.013 s, it has no pose" in complaint(folder(samples=nowhere))
    (home := folder(samples=nowhere)).joinpath("frames.csv").unlink()
    assert complaint(home).startswith("/samples.csv: no row has a pose; frames need the poses")


@pytest.mark.parametrize("description", [BASE + 'frames = "frames/%04d.png"\nmap = "small_loop"\n', None])
def test_without_a_list_there_is_a_frame_at_each_row_with_a_pose(folder, description):
    description = description or TOML.replace("jpg", "png")
    frames = read_log(folder(None, description, pictures=(0, 1, 2, 3, 5, 6), ending="png")).frames
    assert [int(path.stem) for path in frames.paths] == [0, 1, 2, 3, 5, 6]
    assert frames.drives.tolist() == [0, 0, 0, 0, 1, 1]
    np.testing.assert_allclose(frames.times, [5.0, 5.1, 5.2, 5.3, 0.1, 0.3])


def test_the_key_at_the_top_goes_with_a_list_and_with_what_else_is_stated(folder):
    top = TOML.replace("[camera]\n", "") + "[camera]\nrectified = true\n"
    frames = read_log(folder(description=top)).frames
    assert frames.times.tolist() == [5.013, 5.3, 0.2]
    assert frames.rectified


def test_a_log_without_pictures_or_from_tables_has_no_frames(folder):
    old = BASE + 'frames = "frames/%04d.png"\nmap = "small_loop"\n'
    assert read_log(folder(None, old, pictures=())).frames is None
    assert "no such picture, 5 of 6 are missing" in complaint(folder(None, old, pictures=(0,), ending="png"))
    assert read_log(folder(description=BASE)).frames is None
    assert read_log(folder(description=BASE + 'map = "a yard of ours"\n')).frames is None
    table = pd.DataFrame({"episode": "a", "time": [0.0, 0.1], "x": 0.0, "y": 0.0, "heading": 0.0})
    description = {"robot": "tractor", "command": "none", "map": "small_loop", "frames": "frames/%d.png"}
    assert log_of(table, description).frames is None


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (('map = "small_loop"\n', ""), "map: is missing; frames show a map: add its name"),
        (('"small_loop"', '"our yard/loop"'), "map: must be the name of a map, or of a file that ends in .toml"),
        (('"small_loop"', "3"), "map: must be text in quotes"),
        (("frames/%04d.jpg", "frames/4.jpg"), "camera.frames: must have the picture's number once, as %d or %06d"),
        (("frames/%04d.jpg", "%d/%d.jpg"), "camera.frames: must have the picture's number once"),
        (("%04d", "%s"), "camera.frames: must have the picture's number once"),
        (("%04d", "%099999999d"), "camera.frames: must have the picture's number once"),
        (("%04d", "100%%_%d"), "camera.frames: must have the picture's number once"),
        ((".jpg", ".bmp"), "camera.frames: must have the picture's number once, as %d or %06d, and end in .png, .jpg"),
        (('frames = "frames/%04d.jpg"', ""), "camera.frames: is missing"),
        (("[camera]", 'frames = "%d.png"\n[camera]'), "frames: is stated in [camera] too"),
        (("[camera]\n", '[camera]\nmap = "x"\n'), "camera.map: belongs above the line [camera]"),
        (("[camera]\n", "[camera]\nexposur = 1\n"), "camera.exposur: unknown key; did you mean 'exposure'?"),
        (("[camera]\n", '[camera]\nexposure = "long"\n'), "camera.exposure: unknown value 'long'"),
        (("[camera]\n", '[camera]\nrectified = "no"\n'), "camera.rectified: must be true or false"),
        (("[camera]\n", '[camera]\nshutter = "slit"\n'), "camera.shutter: unknown value 'slit'"),
        (("[camera]\n", "[camera]\nreadout_s = 20\n"), "camera.readout_s: must be between 0 and 1"),
        (("[camera]\n", '[camera]\nshutter = "global"\nreadout_s = 0.1\n'), "camera.readout_s: a global shutter"),
        (("[camera]\n", "[camera]\nposes = 0.005\n"), "camera.poses: must be a table"),
        (("[camera]\n", "[camera]\nposes = { position = 1 }\n"), "camera.poses.position: unknown key; did you mean"),
        (("[camera]\n", "[camera]\nposes = { position_m = -1 }\n"), "camera.poses.position_m: must be between 0 and"),
        (("[camera]\n", "camera = 3\n"), "camera: must be a table"),
    ],
)
def test_a_mistake_about_the_camera_is_one_line_with_file_and_key(folder, change, says):
    assert complaint(folder(description=TOML.replace(*change))).startswith(f"/log.toml: {says}")


@pytest.mark.parametrize(
    ("frames", "says"),
    [
        ("", ": is empty"),
        (HEADER, ": has no rows"),
        (b"\xff\xfe\x00", ": is not a CSV file"),
        (LISTED.replace("frame,", ""), ": line 1: no column 'frame'; frames need episode,time,frame"),
        (LISTED.replace("frame", "frames"), ": line 1: unknown column 'frames'; did you mean 'frame'?"),
        (LISTED.replace("9,a", "9.5,a"), ": line 3, column 'frame': must be a whole number from 0 on, got 9.5"),
        (LISTED.replace("9,a", ",a"), ": line 3, column 'frame': must be a finite number, got ''"),
        (LISTED.replace("9,a", "7,a"), ": line 3, column 'frame': 7 comes twice; number the pictures through all"),
        (LISTED.replace("8,b", "8,c"), ": line 4, column 'episode': 'c' is not in samples.csv; add its poses"),
        (LISTED.replace("9,a,5.3", "9,a,5.013"), ": line 3, column 'time': 5.013 s does not come after 5.013 s"),
        (LISTED + "10,a,5.2\n", ": line 5, column 'episode': 'a' comes back after another episode"),
    ],
)
def test_a_mistake_in_frames_csv_is_one_line_with_file_line_and_column(folder, frames, says):
    assert complaint(folder(frames)).startswith(f"/frames.csv{says}")


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


def noise(rows, columns, seed=5):
    return np.random.default_rng((seed, rows, columns)).integers(0, 256, (rows, columns, 3), dtype=np.uint8)


@settings(max_examples=20)
@given(rows=st.integers(20, 300), columns=st.integers(161, 500))
def test_a_width_that_is_no_multiple_is_averaged_all_the_same(tmp_path_factory, rows, columns):
    path, picture = tmp_path_factory.mktemp("odd") / "0.png", noise(rows, columns)
    Image.fromarray(picture).save(path)
    (small,) = read_pictures(Frames((path,), np.zeros(1, dtype=np.int64), np.zeros(1), "small_loop"), [0])
    assert small.shape == (max(1, round(rows * 160 / columns)), 160, 3)
    np.testing.assert_allclose(small.mean(axis=(0, 1)), picture.mean(axis=(0, 1)), atol=2.0)


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


def test_pictures_are_read_in_the_order_asked_for_wider_ones_averaged_and_others_as_they_are(frames_of):
    first, second, third = (noise(12, 16, seed) for seed in range(3))
    frames = frames_of(first, second, third)
    np.testing.assert_array_equal(read_pictures(frames, [2, 0]), [third, first])
    assert len(read_pictures(frames, [])) == 0
    picture = noise(90, 120)
    pictures = read_pictures(frames_of(picture), [0])
    assert pictures.dtype == np.uint8
    np.testing.assert_array_equal(pictures, picture[None])
    picture = noise(480, 640)
    mean = picture.reshape(120, 4, 160, 4, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(read_pictures(frames_of(picture), [0])[0], mean, atol=1.01)


def test_pictures_of_two_sizes_of_sixteen_bits_or_gone_are_refused(frames_of, folder):
    says = complaint_of(read_pictures, frames_of(noise(12, 16), noise(12, 16), noise(12, 20)), [0, 1, 2])
    assert says.endswith("2.png: is 20 × 12, but 0.png is 16 × 12; give all pictures one size")
    deep = frames_of(Image.fromarray(np.full((12, 16), 40000, dtype=np.uint16)))
    assert "more than 8 bits a pixel" in complaint_of(read_pictures, deep, [0])
    frames = frames_of(noise(12, 16))
    frames.paths[0].unlink()
    assert complaint_of(read_pictures, frames, [0]) == f"{frames.paths[0]}: no such file; add the picture"
    remedy = "add them, or name those that there are in frames.csv"
    assert complaint(folder(pictures=(7,))) == f"/frames/0009.jpg: no such picture, 2 of 3 are missing; {remedy}"


@pytest.mark.parametrize("ending", ["png", "jpg"])
@pytest.mark.parametrize(("stored", "orientation"), [(np.rot90, 6), (lambda shown: shown[::-1, ::-1], 3)])
def test_a_picture_is_read_as_its_orientation_says_that_it_is_to_be_shown(frames_of, ending, stored, orientation):
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = orientation
    turned = read_pictures(frames_of(np.ascontiguousarray(stored(LARGE)), ending=ending, exif=exif), [0])
    np.testing.assert_allclose(turned, read_pictures(frames_of(LARGE, ending=ending), [0]), atol=10.0)


def test_a_picture_whose_exif_is_damaged_is_read_as_it_is_stored(frames_of):
    damaged = PngInfo()
    damaged.add_text("Raw profile type exif", "\nexif\n 10\nzz")
    frames = frames_of(LARGE, pnginfo=damaged)
    np.testing.assert_array_equal(read_pictures(frames, [0]), read_pictures(frames_of(LARGE), [0]))


@pytest.mark.parametrize("ending", ["png", "jpg"])
def test_a_picture_that_is_cut_off_is_refused(frames_of, ending):
    frames = frames_of(LARGE, ending=ending)
    frames.paths[0].write_bytes(frames.paths[0].read_bytes()[:2000])
    remedy = "save it again or leave its frame out"
    assert complaint_of(read_pictures, frames, [0]).endswith(f"is not a whole PNG or JPEG picture; {remedy}")
