"""An episode is the same whatever the order in which θ was named."""

from proxytune.domain import make_episode


def test_theta_is_put_in_one_order():
    one = make_episode({"trim": 1, "delay": 0.5}, agent="a", start=0, seed=1)
    assert one == make_episode({"delay": 0.5, "trim": 1.0}, agent="a", start=0, seed=1)
    assert one.theta == (("delay", 0.5), ("trim", 1.0))
