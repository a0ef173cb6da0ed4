"""A file is the old one or the new one, whatever happens between."""

import os

import pytest

from proxytune.drafts import draft_of


def test_the_draft_takes_the_files_name_once_it_is_written(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("old")
    with draft_of(path) as draft:
        draft.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("problem", [KeyboardInterrupt, OSError, ValueError])
def test_what_raises_leaves_the_old_file_and_no_draft(tmp_path, problem):
    path = tmp_path / "table.csv"
    path.write_text("old")
    with pytest.raises(problem), draft_of(path) as draft:
        draft.write_text("half")
        raise problem
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_in_the_drafts_place_is_not_followed(tmp_path):
    victim, path = tmp_path / "precious", tmp_path / "table.csv"
    victim.write_text("mine")
    path.with_name(f".{path.name}.{os.getpid()}").symlink_to(victim)
    with draft_of(path) as draft:
        draft.write_text("new")
    assert (victim.read_text(), path.read_text()) == ("mine", "new")
