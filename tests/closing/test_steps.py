"""A step is done once for the same inputs, and one that was broken off counts as not done."""

import pytest

from proxytune.closing.steps import FILE_NAME, Kept, Step, digest_of_files
from proxytune.errors import StoreError


def step(folder, inputs="a", name="log"):
    done = []

    def do():
        done.append(inputs)
        (folder / name).write_text(inputs)

    return Step(name, inputs, folder / name, do), done


def test_a_step_is_known_after_it_was_done_and_not_with_other_inputs(tmp_path):
    first, done = step(tmp_path)
    assert not Kept(tmp_path).has(first)
    Kept(tmp_path).run(first)
    assert done == ["a"]
    assert Kept(tmp_path).has(first)
    assert not Kept(tmp_path).has(step(tmp_path, "b")[0])


def test_a_step_whose_output_is_gone_is_not_done(tmp_path):
    first, _ = step(tmp_path)
    Kept(tmp_path).run(first)
    first.output.unlink()
    assert not Kept(tmp_path).has(first)


def test_a_step_that_was_broken_off_is_not_done_though_its_old_output_is_there(tmp_path):
    first, _ = step(tmp_path)
    Kept(tmp_path).run(first)

    def interrupted():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Kept(tmp_path).run(Step("log", "b", first.output, interrupted))
    assert first.output.exists()
    assert not Kept(tmp_path).has(first)
    assert not Kept(tmp_path).has(step(tmp_path, "b")[0])


def test_steps_do_not_forget_each_other(tmp_path):
    kept, (first, _), (second, _) = Kept(tmp_path), step(tmp_path), step(tmp_path, name="diagnosis")
    kept.run(first)
    kept.run(second)
    assert Kept(tmp_path).has(first)
    assert Kept(tmp_path).has(second)


@pytest.mark.parametrize("text", ["", "[]", '{"steps": 1}'])
def test_a_broken_file_is_one_line_with_a_remedy(tmp_path, text):
    (tmp_path / FILE_NAME).write_text(text)
    with pytest.raises(StoreError, match="remove it to do every step again"):
        Kept(tmp_path)


def test_a_digest_of_files_changes_with_content_and_names_and_not_with_hidden_or_compiled_files(tmp_path):
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "one").write_text("1")
    before = digest_of_files(tmp_path)
    (tmp_path / ".draft").write_text("half")
    (tmp_path / "__pycache__" / "one.pyc").write_text("compiled")
    assert digest_of_files(tmp_path) == before
    (tmp_path / "one").write_text("2")
    changed = digest_of_files(tmp_path)
    (tmp_path / "one").rename(tmp_path / "two")
    assert len({before, changed, digest_of_files(tmp_path)}) == 3


def test_a_digest_of_a_single_hidden_file_changes_with_its_content(tmp_path):
    model = tmp_path / ".model.toml"
    model.write_text("1")
    before = digest_of_files(model)
    model.write_text("2")
    assert digest_of_files(model) != before
