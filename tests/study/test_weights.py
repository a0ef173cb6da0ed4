import pytest

from proxytune.study.study import open_study
from proxytune.study.weights import unnoticed


def put(folder, *names):
    for name in names:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(b"1")


def test_weights_beside_modules_are_named_in_one_line(make_study):
    folder = make_study()
    put(folder, "mine.py", "net.ONNX", "pack/weights.npz")
    (caution,) = open_study(folder).cautions
    assert caution.startswith("net.ONNX, pack/weights.npz: if agents read this, a change in it is not noticed; ")
    assert "\n" not in caution


@pytest.mark.parametrize(
    "names",
    [
        ("net.pt",),
        ("mine.py", "target.csv", "notes.txt"),
        ("mine.py", "teaching/exam-1.npz", "rescored/a.npz"),
        ("mine.py", ".hidden.npz"),
    ],
)
def test_nothing_is_said_where_no_module_could_read_weights_or_there_are_none(tmp_path, names):
    put(tmp_path, *names)
    assert unnoticed(tmp_path) == ()


def test_of_many_files_only_some_are_named(tmp_path):
    put(tmp_path, "mine.py", *(f"net{number}.pt" for number in range(5)))
    assert unnoticed(tmp_path)[0].startswith("net0.pt, net1.pt, net2.pt and 2 more: ")
