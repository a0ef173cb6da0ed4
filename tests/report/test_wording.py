"""Numbers and names as people read them."""

from proxytune.report.wording import digits, fixed, listed, percent, plain, probability, short, span


def test_numbers_have_a_true_minus_and_as_many_figures_as_their_width_allows_and_names_make_a_list():
    assert [digits(ends) for ends in ((0.108, 0.146), (11.1, 14.4), (3.0, 35.0), (1.0, 1.0))] == [3, 1, 0, 3]
    assert fixed(-0.12, 2) == "−0.12"
    assert fixed(-0.0001, 2) == "0.00"
    assert span((-0.012, 0.03)) == "−0.012 to 0.030"
    assert [short(value) for value in (0.01234, 123.4, 12345.6, -999.6, 1.2345e9)] == (
        ["0.0123", "123", "12346", "−1000", "1.23e+09"]
    )
    shares = [percent(share) for share in (1.0, 0.3141, 0.00162, 0.0000123, 1e-9, 0.0)]
    assert shares == ["100 %", "31 %", "0.16 %", "0.0012 %", "under 0.001 %", "0 %"]
    assert [probability(value) for value in (0.364, 0.0042, 0.0002)] == ["p = 0.36", "p = 0.0042", "p < 0.001"]
    assert [listed(list(names)) for names in ("", "a", "ab", "abc")] == ["", "a", "a and b", "a, b and c"]


def test_names_are_told_as_words_and_one_s_own_effect_as_it_is_written_in_theta():
    assert [plain(name) for name in ("dead_band", "my_lab:WheelDrag.first_turn")] == [
        "dead band",
        "my_lab:WheelDrag.first_turn",
    ]
