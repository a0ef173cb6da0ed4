"""Tables are readable at 80 columns and at 44: names and figures may be broken, but never cut."""

import pytest
from readable import on_terminal

from proxytune.cli import listing
from proxytune.cli.main import COMMANDS, parser
from proxytune.report import Table, columns_of, table_text

LONG = "an_agent_with_a_name_that_is_much_longer_than_any_column_of_a_narrow_terminal"
SCORES = "domain,agent,episode,distance,lane_error_of_the_whole_drive\n" + "".join(
    f"{domain},{agent},{episode},{number + shift * episode},{number - episode}\n"
    for shift, domain in enumerate(("the_target", "a_simulator_with_a_long_name", "another_simulator"))
    for number, agent in enumerate(("a", "b", LONG))
    for episode in (1, 2, 3)
)


def marks(text, width):
    """What is shown at a width, without what lays it out."""
    return sorted("".join(on_terminal(text, width=width).split()))


def assert_whole(text):
    whole = marks(text, 2000)
    assert "…" not in whole
    for width in (80, 44):
        assert marks(text, width) == whole, f"at {width} columns"


def shown(*words):
    return COMMANDS[words[0]].load()(parser(list(map(str, words))).parse_args(list(map(str, words)))).text


@pytest.mark.parametrize("kind", listing._KINDS)
def test_lists_are_whole(kind):
    assert_whole(shown("list", kind))


def test_tables_of_the_scores_of_one_proxy_and_of_several_and_of_a_diagnosis_are_whole(tmp_path):
    (tmp_path / "all.csv").write_text(SCORES)
    metrics = ("--metric", "distance:max", "--metric", "lane_error_of_the_whole_drive:min")
    path = tmp_path / "all.csv"
    for proxies in ((f"{path}:another_simulator",), (path,)):
        words = [word for proxy in proxies for word in ("--proxy", proxy)]
        assert_whole(shown("score", *words, "--target", f"{path}:the_target", *metrics))
    columns = columns_of(("effect",), ("held-out gain [nats]", "p", "value"))
    assert_whole(table_text(Table("Candidates", columns, ((LONG, "1234.5678", "0.001", "−0.123 to 0.456"),))))
