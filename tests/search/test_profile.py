import numpy as np
import pytest
from steps import SPACE

from proxytune.search.design import design_point
from proxytune.search.profile import GRID, profiles
from proxytune.search.proposer import Trial
from proxytune.search.surrogate import fit_surrogate


def found(score, count=40):
    points = [design_point(SPACE, index, 5) for index in range(count)]
    return profiles(fit_surrogate(SPACE, [Trial(point, score(point)) for point in points]))


def only_delay(values):
    """A valley along trim: only delay counts."""
    return float(np.floor(200 * abs(values[0] - 0.1)))


def test_a_parameter_that_the_score_does_not_see_is_unidentified_and_the_other_is_not():
    delay, trim = found(only_delay)
    assert trim.unidentified
    assert trim.interval == (-0.3, 0.3)
    assert not delay.unidentified
    assert 0.0 < delay.interval[0] < 0.1 < delay.interval[1] < 0.2


def test_the_interval_holds_the_best_and_stays_in_the_box():
    for seed in range(4):
        drawn = np.random.default_rng(seed).integers(0, 30, 9).tolist()
        for profile, interval in zip(
            found(lambda values, left=drawn: float(left.pop()), 9), SPACE.intervals, strict=True
        ):
            low, high = profile.interval
            assert interval.low <= low <= profile.best <= high <= interval.high


def test_the_profile_never_lies_above_the_average_over_the_others():
    for profile in found(lambda v: only_delay(v) + 30 * abs(v[1])):
        assert profile.values.shape == profile.lowest.shape == profile.average.shape == (GRID,)
        assert (profile.lowest <= profile.average + 1e-9).all()
        assert (profile.deviation > 0).all()


def test_the_band_holds_the_profile_and_does_not_jump_where_another_valley_becomes_the_lowest():
    """Two valleys; the band around the lowest mean alone jumps by up to 0.15 of its width from one to the other."""

    def valleys(values):
        left = abs(values[0] - 0.05) / 0.3 + abs(values[1] + 0.2)
        right = abs(values[0] - 0.25) / 0.3 + abs(values[1] - 0.2)
        return float(round(60 * min(left, right)))

    for seed in (2, 4):
        points = [design_point(SPACE, index, seed) for index in range(6)]
        for profile in profiles(fit_surrogate(SPACE, [Trial(point, valleys(point)) for point in points])):
            assert (profile.low <= profile.lowest).all()
            assert (profile.lowest <= profile.high).all()
            width = np.ptp(np.concatenate([profile.low, profile.high]))
            assert max(np.abs(np.diff(end)).max() for end in (profile.low, profile.high)) < 0.1 * width


def test_the_average_of_a_sum_has_the_shape_of_its_own_term():
    delay, trim = found(lambda v: 100 * v[0] + 20 * v[1])
    assert np.polyfit(delay.values, delay.average, 1)[0] == pytest.approx(100, rel=0.1)
    assert np.polyfit(trim.values, trim.average, 1)[0] == pytest.approx(20, rel=0.1)


def test_more_trials_make_the_interval_narrower():
    few, many = found(only_delay, 12)[0], found(only_delay, 60)[0]
    assert np.subtract(*few.interval[::-1]) > np.subtract(*many.interval[::-1])


def test_a_score_without_any_structure_leaves_everything_unidentified():
    assert all(profile.unidentified for profile in found(lambda values: 4.0, 8))


def test_the_same_trials_in_another_order_give_the_same_profiles():
    points = [design_point(SPACE, index, 5) for index in range(12)]
    trials = [Trial(point, only_delay(point)) for point in points]
    there, back = (profiles(fit_surrogate(SPACE, told)) for told in (trials, trials[::-1]))
    assert [profile.interval for profile in there] == [profile.interval for profile in back]
    assert np.array_equal(there[0].lowest, back[0].lowest)
