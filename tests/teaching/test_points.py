"""What is cached of a learning experiment is found again only by what would make the very same."""

from dataclasses import dataclass, field

import pytest
from schoolroom import Matrix, Schoolroom
from taught import PROXY, setup
from wobbly import Wobbly

from proxytune.learning.cache import digest
from proxytune.teaching.points import Point


@dataclass(frozen=True)
class Timid(Matrix):
    """Learns nine tenths of what it is shown."""

    def train(self, samples, start, seed):
        return {"matrix": 0.9 * super().train(samples, start, seed)["matrix"]}


CHANGES = {
    "another learner": {"learner": Timid(), "learner_identity": "timid"},
    "more starts": {"starts": 5},
    "another seed": {"seed": 2},
    "another proxy domain": {"proxy": Schoolroom(Wobbly(theta=(("delay", 0.2),)))},
    "another target": {"target": Schoolroom(Wobbly(theta=(("trim", 0.05), ("delay", 0.21))))},
    "more samples of the proxy": {"proxy_samples": 90},
    "longer lessons": {"lesson_s": 3.0},
}


@pytest.mark.parametrize("count", [0, 20])
@pytest.mark.parametrize("change", CHANGES)
def test_a_used_cache_gives_what_an_empty_one_gives(tmp_path, change, count):
    point = Point("near", PROXY, 0, count)
    before = setup(tmp_path / "used").score(point)
    fresh = setup(tmp_path / "empty", **CHANGES[change]).score(point)
    assert fresh != before
    assert setup(tmp_path / "used", **CHANGES[change]).score(point) == fresh


@pytest.mark.parametrize("change", [change for change in CHANGES if "proxy" not in change])
def test_without_a_proxy_a_used_cache_gives_what_an_empty_one_gives(tmp_path, change):
    point = Point("none", None, 0, 20)
    before = setup(tmp_path / "used").score(point)
    fresh = setup(tmp_path / "empty", **CHANGES[change]).score(point)
    assert fresh != before
    assert setup(tmp_path / "used", **CHANGES[change]).score(point) == fresh


def test_what_a_proxy_taught_is_shared_by_all_points_after_it(tmp_path):
    one = setup(tmp_path)
    for count in (0, 20, 40):
        one.score(Point("near", PROXY, 0, count))
    assert len(list(tmp_path.glob("weights-*.npz"))) == 3
    assert len(list(tmp_path.glob("samples-*.npz"))) == 2
    assert one.is_cached(Point("renamed", PROXY, 0, 40))
    assert not one.is_cached(Point("near", PROXY, 1, 40))


@dataclass(frozen=True)
class Noting(Matrix):
    """Notes the samples of each training."""

    trained: list = field(default_factory=list)

    def train(self, samples, start, seed):
        self.trained.append(samples)
        return super().train(samples, start, seed)


def test_a_fine_tuning_goes_over_the_proxys_samples_again_beside_the_targets(tmp_path):
    plain, rehearsing = Noting(), Noting()
    point = Point("near", PROXY, 0, 20)
    setup(tmp_path / "plain", learner=plain).score(point)
    setup(tmp_path / "rehearsing", learner=rehearsing, rehearsal=0.6).score(point)
    taught, target = plain.trained[0].commands.tolist(), plain.trained[1].commands.tolist()
    mixed = rehearsing.trained[1].commands.tolist()
    assert rehearsing.trained[0].commands.tolist() == taught
    assert (len(target), len(mixed)) == (20, 50)
    assert mixed[:20] == target
    assert all(sample in taught for sample in mixed[20:])


def test_rehearsal_changes_fine_tunings_after_a_proxy_and_nothing_else(tmp_path):
    plain, rehearsing = setup(tmp_path), setup(tmp_path, rehearsal=0.6)
    tuned, taught, alone = Point("near", PROXY, 0, 20), Point("near", PROXY, 0, 0), Point("none", None, 0, 20)
    assert plain.exam_facts(tuned) != rehearsing.exam_facts(tuned)
    assert plain.exam_facts(tuned) != setup(tmp_path, rehearsal=0.5).exam_facts(tuned)
    for point in (taught, alone):
        assert plain.exam_facts(point) == rehearsing.exam_facts(point)
    before = plain.score(tuned)
    assert (
        setup(tmp_path, rehearsal=0.6).score(tuned) == setup(tmp_path / "empty", rehearsal=0.6).score(tuned) != before
    )


# The names that files had then
KEPT = {
    "ff67f18fe321ea72a41a": Point("near", PROXY, 0, 20),
    "454406ad67f24dd8d50c": Point("none", None, 0, 20),
    "bfde94b57c9b6b4fe41f": Point("near", PROXY, 0, 0),
}


@pytest.mark.parametrize("name", KEPT)
def test_what_was_kept_before_there_was_rehearsal_is_found_again(tmp_path, name):
    assert digest(setup(tmp_path).exam_facts(KEPT[name])) == name
