"""What lessons cost, and what of them is cached: made once, and told apart by all that determines it."""

import contextlib
import importlib
import sys
import zipfile
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from schoolroom import SAMPLES_PER_S, Matrix, Schoolroom
from tightrope import Tightrope
from wobbly import Wobbly

from proxytune.domain import Demonstration, make_episode
from proxytune.errors import EpisodeError, LearnerError, StoreError
from proxytune.learning import Cache, Costs, Distribution, collect_samples, mix_samples, policy_of
from proxytune.learning.lessons import cost_saved, examine_policy, facts_digest, learner_identity, split_samples
from proxytune.learning.ridge import RandomFeatures


def test_arrays_are_made_once_and_read_back_to_the_last_bit(tmp_path):
    cache, made = Cache(tmp_path / "kept"), []

    def make():
        made.append(1)
        return {"values": np.random.default_rng(3).normal(size=(4, 2)), "small": np.arange(3, dtype=np.uint8)}

    first, again = (cache.get("samples", {"seed": 1}, make) for _ in range(2))
    assert len(made) == 1
    assert set(first) == {"values", "small"}
    assert all(np.array_equal(first[name], again[name]) and first[name].dtype == again[name].dtype for name in first)
    assert np.array_equal(first["values"], np.random.default_rng(3).normal(size=(4, 2)))


def test_facts_determine_arrays_and_are_told_in_the_file(tmp_path):
    assert facts_digest({"a": 1, "b": 2.0}) == facts_digest({"b": 2.0, "a": 1})
    assert len({facts_digest({"a": value}) for value in (1, 2, 1.5, "1", None)}) == 5
    cache = Cache(tmp_path)
    cache.get("exam", {"seed": 7, "theta": {"trim": 0.1}}, lambda: {"scores": np.zeros(2)})
    with np.load(cache.path("exam", {"theta": {"trim": 0.1}, "seed": 7})) as file:
        assert str(file["facts"]) == '{"seed": 7, "theta": {"trim": 0.1}}'


def test_what_failed_is_not_there_and_a_closed_folder_is_told(tmp_path):
    cache = Cache(tmp_path)
    with pytest.raises(ZeroDivisionError):
        cache.get("exam", {"seed": 1}, lambda: 1 / 0)
    assert not cache.has("exam", {"seed": 1})
    (tmp_path / "kept").write_text("a file, where the folder should be")
    with pytest.raises(StoreError, match="cannot be written"):
        Cache(tmp_path / "kept").get("exam", {}, lambda: {"scores": np.zeros(1)})


@pytest.mark.parametrize("keep", [0, 10, 200])
def test_a_damaged_file_is_one_line_with_a_remedy(tmp_path, keep):
    cache, facts = Cache(tmp_path), {"seed": 1}
    cache.get("exam", facts, lambda: {"scores": np.zeros(200)})
    path = cache.path("exam", facts)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(StoreError, match="is damaged .*delete it, and run again"):
        cache.get("exam", facts, dict)


@pytest.mark.parametrize("place", [0.3, 0.5, 0.7, 0.9])
def test_a_flipped_byte_is_one_line_or_in_no_array(tmp_path, place):
    cache, facts = Cache(tmp_path), {"seed": 1}
    noise = {"scores": np.random.default_rng(1).normal(size=500)}
    cache.get("exam", facts, lambda: noise)
    path = cache.path("exam", facts)
    content = bytearray(path.read_bytes())
    content[int(place * len(content))] ^= 0xFF
    path.write_bytes(content)
    with contextlib.suppress(StoreError):
        assert (cache.get("exam", facts, dict)["scores"] == noise["scores"]).all()


def test_an_array_of_impossible_size_is_damage(tmp_path):
    cache, facts = Cache(tmp_path), {"seed": 1}
    path = cache.path("exam", facts)
    header = repr({"descr": "<f8", "fortran_order": False, "shape": (10**12,)}).encode().ljust(117) + b"\n"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("scores.npy", b"\x93NUMPY\x01\x00v\x00" + header)
    with pytest.raises(StoreError, match="is damaged .*delete it"):
        cache.get("exam", facts, dict)


COSTS = Costs(off_policy=3.0, on_policy=0.5, label=0.25)
counts = st.floats(0.0, 1e6)


@given(counts, counts)
def test_on_policy_and_off_policy_samples_are_all_there_are(count, expert_drives):
    on, off = split_samples(count, expert_drives)
    assert on >= 0.0
    assert 0.0 <= off <= expert_drives
    assert on + off == count or abs(on + off - count) < 1e-9 * count


def test_costs_are_told_by_who_drove_and_how_many_samples_it_takes():
    on, off = split_samples(np.array([0.0, 10.0, 25.0]), 10.0)
    assert (on.tolist(), off.tolist()) == ([0.0, 0.0, 15.0], [0.0, 10.0, 10.0])
    assert split_samples(np.inf, np.inf) == (0.0, np.inf)
    never, off_policy = split_samples(np.inf, 10.0), split_samples(np.array([np.inf, 4.0]), np.inf)
    assert cost_saved(COSTS, without=off_policy, with_proxy=(0.0, 0.0)).tolist() == [np.inf, 13.0]
    assert cost_saved(COSTS, without=never, with_proxy=(0.0, 0.0)) == np.inf
    free = Costs(off_policy=2.0, on_policy=0.0)
    assert cost_saved(free, without=split_samples(np.inf, 10.0), with_proxy=split_samples(5.0, 0.0)) == 20.0
    assert cost_saved(COSTS, without=split_samples(25.0, 10.0), with_proxy=(0.0, 0.0)) == 10 * 3.25 + 15 * 0.75
    saved = cost_saved(COSTS, without=(np.array(50.0), np.array(400.0)), with_proxy=(np.array(10.0), np.array(100.0)))
    assert saved == 40 * 0.75 + 300 * 3.25


@given(counts, counts, st.floats(0.0, 1e3))
def test_more_samples_never_cost_less(count, more, expert_drives):
    splits = (split_samples(count + more, expert_drives), split_samples(count, expert_drives))
    assert cost_saved(COSTS, without=splits[0], with_proxy=splits[1]) >= 0.0


@given(counts, counts)
def test_at_equal_costs_without_labels_the_saving_is_plv_itself(without, needed):
    splits = {"without": split_samples(without, 50.0), "with_proxy": split_samples(needed, 0.0)}
    assert abs(cost_saved(Costs(), **splits) - (without - needed)) < 1e-6


EPISODES = [make_episode({}, agent="pupil", start=start, seed=7) for start in range(4)]
WEIGHTS = {"matrix": np.ones((3, 2))}


@dataclass(frozen=True)
class Together(Schoolroom):
    """Adds a point, so that it is seen who has been asked; loses some scores."""

    lost: int = 0

    def examine_together(self, episodes, policy):
        return tuple(self.examine(episode, policy) + 1.0 for episode in episodes[self.lost :])


@dataclass(frozen=True)
class Manifold(Matrix):
    def act_many(self, weights, observations):
        return observations @ weights["matrix"]


def test_classrooms_and_policies_are_asked_for_many_at_once_only_if_they_can():
    policy = policy_of(Matrix(), WEIGHTS)
    alone = [Schoolroom(Wobbly()).examine(episode, policy) for episode in EPISODES]
    assert examine_policy(Schoolroom(Wobbly()), EPISODES, policy) == alone
    assert examine_policy(Together(Wobbly()), EPISODES, policy) == [score + 1.0 for score in alone]
    seen = np.arange(12.0).reshape(4, 3)
    one, many = policy_of(Matrix(), WEIGHTS), policy_of(Manifold(), WEIGHTS)
    assert not hasattr(one, "act_many")
    np.testing.assert_array_equal(many.act_many(seen), [one(row) for row in seen])
    np.testing.assert_array_equal(many(seen[0]), one(seen[0]))
    with pytest.raises(EpisodeError, match="examine_together gave 3 scores for 4 episodes; give each its own"):
        examine_policy(Together(Wobbly(), lost=1), EPISODES, policy_of(Matrix(), WEIGHTS))


@pytest.mark.parametrize("score", [np.nan, np.inf, -np.inf])
def test_a_score_that_is_no_finite_number_is_told_with_its_start(score):
    with pytest.raises(EpisodeError, match=r"the examination from start 2 gave -?(nan|inf); give a finite score"):
        unfinished = SimpleNamespace(examine=lambda episode, policy: score if episode.start == 2 else 1.0)
        examine_policy(unfinished, EPISODES, policy_of(Matrix(), WEIGHTS))


MINE = """
from dataclasses import dataclass
from my_cells import cells
import my_unused

@dataclass(frozen=True)
class Mine:
    size: int = 3
"""


@pytest.fixture
def identity(tmp_path, monkeypatch):
    """The identity of a learner whose module and the one beside it are as written."""
    monkeypatch.syspath_prepend(str(tmp_path))
    names = ("my_learner", "my_cells", "my_unused")

    def identity_of(mine=MINE, cells="def cells(): return 1", size=3):
        for name, text in zip(names, (mine, cells, "VALUE = 1"), strict=True):
            (tmp_path / f"{name}.py").write_text(text)
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        monkeypatch.setattr(sys, "dont_write_bytecode", True)
        return learner_identity(importlib.import_module("my_learner").Mine(size))

    yield identity_of
    for name in names:
        sys.modules.pop(name, None)


def test_a_learner_is_another_by_settings_or_code_not_comments_and_a_shipped_one_by_its_eyes_too(identity, monkeypatch):
    others = [identity(size=4), identity(mine=MINE + "    more: int = 1\n"), identity(cells="def cells(): return 2")]
    assert len({identity(), *others}) == 4
    assert identity() == identity(mine=MINE + "\n# a remark\n") == identity(cells="def cells(): return 1  # one")
    files = []
    monkeypatch.setattr("proxytune.learning.lessons.meaning_of", lambda paths, root: files.extend(paths) or "")
    learner_identity(RandomFeatures())
    assert {"ridge.py", "cloning.py"} <= {path.name for path in files}
    assert "settings.py" not in {path.name for path in files}


ROOM = Schoolroom(Wobbly())
WIDE = Distribution({"delay": (0.0, 0.3), "trim": (0.1, 0.1)})


def test_lessons_of_more_begin_with_those_of_fewer_and_thetas_are_drawn_for_each_where_free(tmp_path):
    short, long = (collect_samples(ROOM, WIDE, count=count, seed=4, lesson_s=1.0) for count in (17, 60))
    assert len(short.commands) == len(short.observations) == 17
    assert len(long.commands) == 60
    assert np.array_equal(long.observations[:17], short.observations)
    assert np.array_equal(long.commands[:17], short.commands)
    one, other = (collect_samples(ROOM, WIDE, count=20, seed=seed, lesson_s=1.0) for seed in (1, 2))
    assert not np.array_equal(one.commands, other.commands)
    thetas = []

    class Spying(Schoolroom):
        def demonstrate(self, episode, seconds):
            thetas.append(dict(episode.theta))
            return super().demonstrate(episode, seconds)

    collect_samples(Spying(Wobbly()), WIDE, count=20 * SAMPLES_PER_S, seed=1, lesson_s=1.0)
    delays = [theta["delay"] for theta in thetas]
    assert {theta["trim"] for theta in thetas} == {0.1}
    assert len(set(delays)) == len(delays) == 20
    assert 0.0 <= min(delays) < 0.1 < 0.2 < max(delays) <= 0.3

    fixed = Distribution({"trim": (0.1, 0.1)})
    assert fixed.fixed
    assert not WIDE.fixed
    assert fixed.draw(1) == fixed.centre == {"trim": 0.1}
    assert WIDE.centre == {"delay": 0.15, "trim": 0.1}


@pytest.mark.parametrize("blocked", [0.7, 1.0])
def test_an_expert_that_cannot_drive_ends_it_with_where_and_how_badly(blocked):
    with pytest.raises(LearnerError, match=r"cannot drive here: .*% of \d+ lessons at delay in \[0, 0.3\], trim = 0.1"):
        collect_samples(Schoolroom(Wobbly(), blocked=blocked), WIDE, count=1000, seed=1, lesson_s=1.0)


def test_a_guided_lesson_shows_what_the_policy_visits_with_the_experts_commands():
    room = Tightrope(Wobbly())
    how = {"count": 30, "seed": 1, "lesson_s": 2.0}
    policies = (None, lambda observation: np.zeros(1))
    shown, guided = (collect_samples(room, Distribution({}), policy=policy, **how) for policy in policies)
    assert len(guided.commands) == 30
    assert np.array_equal(guided.commands, -1.2 * guided.observations)
    assert np.abs(guided.observations).max() > 2.0 * np.abs(shown.observations).max()


@pytest.mark.parametrize(
    ("room", "policy"), [(Tightrope(Wobbly()), lambda seen: np.full(1, 5.0)), (Schoolroom(Wobbly(), blocked=0.4), None)]
)
def test_where_a_learner_falls_at_once_or_the_road_is_left_further_lessons_make_up_for_it(room, policy):
    assert len(collect_samples(room, Distribution({}), count=50, seed=1, lesson_s=1.0, policy=policy).commands) == 50


def numbered(first, count):
    """Samples that are told apart by their number."""
    numbers = np.arange(first, first + count)
    return Demonstration(numbers[:, None].astype(np.uint8), np.stack((numbers, -numbers), axis=1).astype(float))


@pytest.mark.parametrize(("share", "earlier"), [(0.0, 0), (0.2, 5), (0.5, 20), (0.8, 80), (0.9, 100)])
def test_the_share_is_that_of_the_earlier_samples_as_long_as_there_are_enough(share, earlier):
    mixed = mix_samples(numbered(0, 20), numbered(100, 100), share)
    assert len(mixed.commands) == len(mixed.observations) == 20 + earlier
    assert mixed.commands[:20, 0].tolist() == list(range(20))
    assert (mixed.commands[20:, 0] >= 100).all()
    np.testing.assert_array_equal(mixed.observations[:, 0], mixed.commands[:, 0].astype(np.uint8))


def test_the_earlier_samples_taken_are_all_different_and_lie_over_all_lessons():
    taken = mix_samples(numbered(0, 20), numbered(100, 100), 0.5).commands[20:, 0]
    assert len(set(taken)) == 20
    assert (taken[0], taken[-1]) == (100.0, 199.0)
    assert np.diff(taken).max() <= 6.0
