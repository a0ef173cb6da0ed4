"""What was asked for lately is not worked out again."""

from proxytune.diagnosis.measured.recent import MOST, Recent


def asked_of(keys):
    """The keys for which a result was worked out."""
    recent, made = Recent(), []
    for key in keys:
        assert recent.get(key, lambda key=key: made.append(key) or 10 * key) == 10 * key
    return made


def test_the_same_is_worked_out_once():
    assert asked_of([1, 2, 1, 2, 2, 1]) == [1, 2]


def test_what_was_asked_for_longest_ago_is_forgotten_first():
    fill = list(range(MOST))
    assert asked_of([*fill, 0, MOST, 0, 1]) == [*fill, MOST, 1]
