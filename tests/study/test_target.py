"""The target's table as people have it: in several files, with names of its own."""

import pytest

from proxytune.errors import InputError
from proxytune.study.study import facts, open_study

HEAD = "agent,episode,distance,survival_time"


@pytest.fixture
def rows(make_study):
    """The rows of the target of a study, which is there from now on."""
    return (make_study() / "target.csv").read_text().splitlines()[1:]


def write(folder, **files):
    for name, lines in files.items():
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")


def test_a_target_in_several_files_is_the_one_that_it_would_be_in_one(make_study, rows):
    whole = open_study(make_study())
    folder = make_study(target='["monday.csv", "tuesday.csv"]')
    write(folder, monday=[HEAD, *rows[:7]], tuesday=[HEAD, *rows[7:]])
    assert facts(open_study(folder)) == facts(whole)


def test_an_episode_in_two_files_is_refused_with_both(make_study, rows):
    folder = make_study(target='["monday.csv", "tuesday.csv"]')
    write(folder, monday=[HEAD, *rows], tuesday=[HEAD, rows[0]])
    with pytest.raises(InputError, match=r"tuesday.csv: line 2: agent 'agent0' has episode '0' twice, once in .*mon"):
        open_study(folder)


def test_columns_have_the_target_s_own_names(make_study, rows):
    whole = open_study(make_study())
    columns = '{ agent = "policy", episode = "trial", distance = "dist_m" }'
    folder = make_study(target='"real.csv"', target_columns=columns)
    european = [row.replace(",", ";").replace(".", ",") for row in rows]
    write(folder, real=["policy;trial;dist_m;survival_time", *european])
    assert facts(open_study(folder)) == facts(whole)
    make_study(target='"real.csv"', target_columns='{ agent = "polcy" }')
    with pytest.raises(InputError, match="no column 'agent'; columns found: policy, trial, dist_m, survival_time"):
        open_study(folder)


@pytest.mark.parametrize(
    ("target", "complaint"), [("[]", "target: must be text"), ("3", "target: must be text"), ("[3]", "list of texts")]
)
def test_a_target_of_another_kind_is_refused(make_study, target, complaint):
    with pytest.raises(InputError, match=complaint):
        open_study(make_study(target=target))


def test_agents_that_are_on_one_side_only_are_named_on_either(make_study, rows):
    folder = make_study(target='"real.csv"')
    write(folder, real=[HEAD, *(row for row in rows if "agent5" not in row), "human,0,1,2", "human,1,1,2"])
    study = open_study(folder)
    assert study.settings.agents == tuple(f"agent{number}" for number in range(5))
    assert study.cautions[:2] == (
        "the target has no scores of agent5: left out",
        "the target has scores of human, no agents of this study: left out",
    )


def test_where_no_name_agrees_a_table_of_names_is_the_remedy(make_study, rows):
    folder = make_study(target='"real.csv"')
    write(folder, real=[HEAD, *(row.replace("agent", "a") for row in rows)])
    with pytest.raises(InputError, match=r"its agents are a0, a1.*by a table \[agents\] in study.toml: a0 = 'agent0'"):
        open_study(folder)


def test_episodes_that_are_no_starts_of_the_study_are_left_out_and_that_is_said(make_study, rows):
    folder = make_study(target='"real.csv"')
    write(folder, real=[HEAD, *rows, *(f"agent{number},17,1,2" for number in range(6))])
    study = open_study(folder)
    assert "17" not in study.target.episodes
    (line,) = [one for one in study.cautions if "taken for this study's starts" in one]
    assert "and 1 of others are left out; raise starts to use them" in line
