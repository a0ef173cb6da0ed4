"""Score tables are read strictly and written reproducibly."""

import pytest
from one_line import complaint_of

from proxytune.errors import ScoresError
from proxytune.scores import read_domains, read_scores, write_scores

GOOD = "agent,episode,distance,time\nA,1,1.5,10\nA,2,2.5,20\nB,1,3,30\n"


@pytest.fixture
def csv(write_file):
    return lambda content, name="scores.csv": write_file(content, name)


def test_a_table_keeps_episodes_counts_and_means(csv):
    table = read_scores(csv(GOOD), ["distance", "time"])
    assert (table.agents, table.episodes, table.metrics) == (("A", "B"), ("1", "2"), ("distance", "time"))
    assert table.counts.tolist() == [2, 1]
    assert table.means.tolist() == [[2.0, 15.0], [3.0, 30.0]]
    assert not table.complete


def test_only_the_metrics_asked_for_are_read_of_domains_apart_whatever_a_spreadsheet_marks(csv):
    table = read_scores(csv("agent,comment,distance\nA,fine,1\nB,,2\n"), ["distance"])
    assert table.means[:, 0].tolist() == [1.0, 2.0]
    path = csv("domain,agent,distance\nsim,A,1\nreal,A,2\n")
    assert list(read_domains(path, ["distance"])) == ["sim", "real"]
    assert read_scores(path, ["distance"], "real").means[0, 0] == 2.0
    table = read_scores(csv(b"\xef\xbb\xbfagent, episode ,distance\r\nA,1, 1.5\r\n\r\nB,1,2\r\n"), ["distance"])
    assert table.means[:, 0].tolist() == [1.5, 2.0]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "is empty"),
        ("\n\n", "is empty"),
        ("agent,distance\n", "has no rows"),
        ("robot,distance\nA,1\n", "no column 'agent'"),
        ("name,trial,distance\nA,1,2\n", "columns found: name, trial, distance; rename the one that names the agents"),
        ("name,trial,distance\nA,1,2\n", "or give its name: --columns agent=name (in study.toml: target_columns)"),
        ("agent;distance\nA;1,234.5\n", "'1,234.5' has a comma, but line 2 has '1,234.5'"),
        ("agent;distance\nA;1,5\nB;1.5\n", "line 2, column 'distance': '1,5' has a comma, but line 3 has '1.5'"),
        ("agent,distanc\nA,1\n", "no column 'distance'; did you mean 'distanc'?"),
        ("agent,distance,distance\nA,1,2\n", "column 'distance' twice"),
        ("agent,distance\nA,1\nB,nan\n", "line 3, column 'distance': must be a finite number, got 'nan'"),
        ("agent,distance\nA,1\nB,\n", "line 3, column 'distance': must be a finite number, got ''"),
        ("agent,distance\nA,inf\n", "must be a finite number"),
        ("agent,distance\nA,1e300\n", "must be a finite number"),
        ("agent,distance\nA,far\n", "must be a finite number, got 'far'"),
        ("agent,distance\nA,1_000\n", "must be a finite number, got '1_000'"),
        ("agent,distance\nA,٣\n", "must be a finite number, got '٣'"),
        ("agent,distance\nA,1e99\n", "must be a finite number, got '1e99'; give it in another unit"),
        ("agent,distance\nA\n", "line 2: has 1 cells, but the first line names 2"),
        ("agent,distance\nA,1,2\n", "line 2: has 3 cells, but the first line names 2"),
        ("agent,distance\n,1\n", "line 2, column 'agent': is empty"),
        ("agent,episode,distance\nA,,1\n", "line 2, column 'episode': is empty"),
        ("agent,distance\nA,1\nA,2\n", "line 3: agent 'A' is there twice; add a column 'episode'"),
        ("agent,episode,distance\nA,1,1\nA,1,2\n", "line 3: agent 'A' has episode '1' twice"),
        ("domain,agent,distance\nx,A,1\ny,A,1\nx,A,2\n", "line 4: agent 'A' is there twice in domain 'x'"),
        (b"\x89PNG\r\n\x1a\n\xff", "is not a CSV file"),
        ('agent,distance\n"A,1\n', "is not a CSV file"),
        ('{"agent": "A"}', "no column 'agent'"),
    ],
)
def test_a_bad_file_gives_one_line_with_file_place_and_remedy(csv, text, complaint):
    path = csv(text)
    told = complaint_of(read_scores, path, ["distance"])
    assert told.startswith(f"{path}: ")
    assert complaint in told


def test_the_domain_must_be_chosen_and_known(csv, tmp_path):
    path = csv("domain,agent,distance\nsim,A,1\nreal,A,2\n")
    with pytest.raises(ScoresError, match="has the domains sim, real; choose one"):
        read_scores(path, ["distance"])
    with pytest.raises(ScoresError, match="no domain 'rael'; did you mean 'real'"):
        read_scores(path, ["distance"], "rael")
    with pytest.raises(ScoresError, match="has no column 'domain'"):
        read_scores(csv(GOOD), ["distance"], "real")
    with pytest.raises(ScoresError, match="no such file"):
        read_scores(tmp_path / "none.csv", ["distance"])
    with pytest.raises(ScoresError, match="cannot be read"):
        read_scores(tmp_path, ["distance"])


def test_what_cannot_be_written_leaves_nothing_behind_and_else_bytes_and_values_are_the_same(csv, tmp_path):
    table = read_scores(csv(GOOD), ["distance"])
    (tmp_path / "folder").mkdir()
    with pytest.raises(ScoresError, match="cannot be written"):
        write_scores(table, tmp_path / "scores.csv" / "x.csv")
    with pytest.raises(ScoresError, match="cannot be written"):
        write_scores(table, tmp_path / "folder")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder", "scores.csv"]
    write_scores(read_scores(csv(GOOD.replace("1.5", "0.1")), ["distance", "time"]), tmp_path / "one.csv")
    write_scores(read_scores(tmp_path / "one.csv", ["distance", "time"]), tmp_path / "two.csv")
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "two.csv").read_bytes()
    written = "agent,episode,distance,time\nA,1,0.1,10.0\nA,2,2.5,20.0\nB,1,3.0,30.0\n"
    assert (tmp_path / "one.csv").read_text() == written


@pytest.mark.parametrize(
    "text",
    [
        "policy;trial;dist_m\nA;1;1,5\nA;2;2,5\nB;1;3\n",
        "policy\ttrial\tdist_m\nA\t1\t1,5\nA\t2\t2,5\nB\t1\t3\n",
        "policy\ttrial\tdist_m\nA\t1\t1.5\nA\t2\t2.5\nB\t1\t3\n",
        "agent,trial,distance,dist_m\nA,1,9,1.5\nA,2,9,2.5\nB,1,9,3\n",
    ],
    ids=["semicolons", "tabs and commas", "tabs and points", "some names of its own, and one name taken"],
)
def test_separators_decimals_and_names_of_columns_are_the_user_s(csv, text):
    columns = {"agent": "policy" if "policy" in text else "agent", "episode": "trial", "distance": "dist_m"}
    table = read_scores(csv(text), ["distance"], columns=columns)
    assert (table.agents, table.episodes, table.metrics) == (("A", "B"), ("1", "2"), ("distance",))
    assert table.means[:, 0].tolist() == [2.0, 3.0]


def test_several_files_make_one_table_and_a_name_in_a_column_map_that_no_file_has_is_refused(csv):
    whole = read_scores(csv(GOOD), ["distance"])
    one, two = csv("agent,episode,distance\nA,1,1.5\n", "one.csv"), "agent;episode;distance\nA;2;2,5\nB;1;3\n"
    table = read_scores([one, csv(two, "two.csv")], ["distance"])
    assert (table.agents, table.episodes, table.means.tolist()) == (whole.agents, whole.episodes, whole.means.tolist())
    with pytest.raises(ScoresError, match=r"two.csv: line 2: agent 'A' has episode '1' twice, once in .*one.csv; num"):
        read_scores([one, csv("agent,episode,distance\nA,1,2\n", "two.csv")], ["distance"])
    with pytest.raises(ScoresError, match=r"two.csv: has no column 'episode', which .*one.csv has; add it"):
        read_scores([one, csv("agent,distance\nB,2\n", "two.csv")], ["distance"])
    with pytest.raises(ScoresError, match="no column 'trail' for 'episode'; did you mean 'trial'"):
        read_scores(csv("agent,trial,distance\nA,1,2\n"), ["distance"], columns={"episode": "trail"})
