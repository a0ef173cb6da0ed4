"""A family asked through a guard, and agents by other names in tables than those that are loaded."""

import sqlite3

import pytest
from one_line import complaint_of
from wobbly import Wobbly

from proxytune.api.driving import drive
from proxytune.api.study import run_study
from proxytune.domain import make_episode
from proxytune.errors import ExtensionError, InputError, SettingsError
from proxytune.study import load_family, open_study, read_study_settings, study_facts
from proxytune.study.guard import UserFamily


def load(folder):
    settings = read_study_settings(folder)
    return load_family(settings, settings.proxy)


def test_facts_and_factories_get_what_study_toml_says(make_study):
    folder = make_study(domain={"version": '"7"'}, proxy='"model.toml"')
    (folder / "model.toml").write_text("trim = 0.2\n")
    family = load(folder)
    assert (family.version, family.theta) == ("7", (("trim", 0.2),))
    known = study_facts(open_study(make_study()))
    assert known["agents"] == [f"agent{number}" for number in range(6)]
    assert not any(key.startswith("agents.") for key in known)


BAD = {
    "no colon": ({"family": '"wobbly"'}, "family: family 'wobbly' is unknown (your own is written module:attribute)"),
    "no such module": ({"family": '"wobbli:wobbly"'}, "family 'wobbli:wobbly': no module 'wobbli' in "),
    "no such factory": ({"family": '"wobbly:wobly"'}, "'wobbly:wobly': wobbly has no 'wobly'; did you mean 'wobbly'?"),
    "a factory with a bug": (
        {"family": '"wobbly:broken_factory"'},
        "raised KeyError: 'robot' (wobbly.py, line 125); correct it",
    ),
    "a factory without a model": (
        {"family": '"wobbly:domain_alone"'},
        "family: wobbly:domain_alone cannot be called (got an unexpected keyword argument 'model'); "
        "write it as: def domain_alone(domain, *, model)",
    ),
    "a factory of nothing": ({"family": '"wobbly:nothing_at_all"'}, "cannot be called (too many positional arguments)"),
    "something else": ({"family": '"wobbly:not_a_family"'}, "made no domain family: it lacks identity, metrics"),
    "a missing model": ({"proxy": '"nowhere.toml"'}, "proxy: no such file: "),
    "an unknown parameter": (
        {"parameters": {"trimm": "[0, 0.1]"}},
        "parameters.trimm: unknown parameter; did you mean 'trim'?",
    ),
    "a box beyond the family's": (
        {"parameters": {"trim": "[-0.5, 0.3]"}},
        "parameters.trim: must lie within [-0.3, 0.3], got [-0.5, 0.3]",
    ),
    "too many starts": ({"starts": "6"}, "starts: the family has 5, got 6"),
    "an unknown metric": ({"metrics": '["distanc:max"]'}, "unknown metric 'distanc'; did you mean 'distance'?"),
    "an unknown agent": ({"agents": '["agent0", "agnet1"]'}, "agents: no agent 'agnet1'; did you mean 'agent1'?"),
    "an unknown key of the domain": ({"domain": {"robt": "1"}}, "domain.robt: unknown key"),
}


@pytest.mark.parametrize(("changes", "expected"), BAD.values(), ids=BAD)
def test_every_mistake_gets_one_line_with_file_and_key(make_study, changes, expected):
    told = complaint_of(load, make_study(**changes))
    assert expected in told
    assert "study.toml: " in told


FAULTY = """
class Faulty:
    identity, metrics, starts = "1", {{"distance": "m", "survival_time": "s"}}, 5
    parameters = {{}}

    def check_agent(self, name): ...
    def run(self, episode): ...

    {fault}


def make(domain, *, model):
    assert dict(domain) == {{**domain}} == dict(domain.items())
    assert list(domain) == list(domain.keys()) and "nothing" not in domain
    return Faulty()
"""

FAULTS = {
    "parameters": ("parameters = property(lambda self: 1 / 0)", "parameters of faulty_{n}:make raised ZeroDiv"),
    "identity": ("identity = property(lambda self: self.gone)", "identity of faulty_{n}:make raised AttributeError"),
    "metrics": ("metrics = ['distance']", "metrics of faulty_{n}:make must be a mapping, got list"),
    "starts": ("starts = '5'", "starts of faulty_{n}:make must be a whole number, got str"),
    "no Parameter": ("parameters = {'trim': 3, 'delay': 3}", "of faulty_{n}:make must be a Parameter, got int"),
}


@pytest.mark.parametrize("case", FAULTS)
def test_what_a_foreign_family_does_wrong_is_one_line_with_its_name(make_study, case):
    fault, expected = FAULTS[case]
    number = list(FAULTS).index(case)
    folder = make_study(family=f'"faulty_{number}:make"')
    (folder / f"faulty_{number}.py").write_text(FAULTY.format(fault=fault))
    told = complaint_of(load, folder).replace("parameters['delay'] ", "")
    assert f"study.toml: family: {expected.format(n=number)}" in told


ALIASES = (("good", "agent0"), ("bad", "agent1"))
TABLE = "{ " + ", ".join(f'a{number} = "agent{number}"' for number in range(6)) + " }"


class Faulty(Wobbly):
    versions = property(lambda self: 1 / 0)
    identity = property(lambda self: self.theta.gone)

    def check_agent(self, name):
        raise OSError("no weights")


@pytest.mark.parametrize("member", ["versions", "identity"])
def test_what_a_member_raises_whenever_it_is_asked_is_one_line_with_its_name_and_place(member):
    family = UserFamily(Faulty(), "sim:make")
    expected = rf"{member} of sim:make raised .*Error: .*\(test_family.py, line \d+\); correct it"
    with pytest.raises(ExtensionError, match=expected):
        getattr(family, member)


def test_what_a_member_raises_is_one_line_and_one_that_is_not_there_is_not_there():
    with pytest.raises(
        ExtensionError, match=r"check_agent\('agent0'\) of sim:make raised OSError: no weights .*correct"
    ):
        UserFamily(Faulty(), "sim:make", ALIASES).check_agent("good")
    family = UserFamily(Wobbly(), "sim:make")
    assert not hasattr(family, "versions")
    assert (family.identity, family.starts) == (Wobbly().identity, 5)


def test_an_alias_drives_as_what_it_stands_for_also_among_several():
    family = UserFamily(Wobbly(), "sim:make", ALIASES)
    episode = make_episode({}, agent="good", start=0, seed=1)
    assert family.run(episode) == Wobbly().run(make_episode({}, agent="agent0", start=0, seed=1))
    assert len({family.identity, Wobbly().identity, UserFamily(Wobbly(), "sim:make", ALIASES[:1]).identity}) == 3
    episodes = [make_episode({}, agent=agent, start=0, seed=1) for agent in ("good", "pupil")]
    assert UserFamily(Examiner(), "sim:make", ALIASES).examine_together(episodes, 3) == [("agent0", 3), ("pupil", 3)]
    assert UserFamily(Examiner(), "sim:make").examine_together(episodes, 3) == [("good", 3), ("pupil", 3)]
    assert not hasattr(UserFamily(Wobbly(), "sim:make", ALIASES), "examine_together")


class Agents:
    """Answers who drives, whatever is asked of an episode."""

    def __getattr__(self, member):
        if member.startswith("__"):
            raise AttributeError(member)
        return lambda episode, *rest: (member, episode.agent, *rest)


@pytest.mark.parametrize("member", ["run", "record", "drive", "replay", "demonstrate", "guide", "examine"])
def test_whatever_is_asked_of_an_episode_is_passed_on_by_the_name_that_the_family_knows(member):
    family = UserFamily(Agents(), "sim:make", ALIASES)
    assert getattr(family, member)(make_episode({}, agent="good", start=0, seed=1), 1.5) == (member, "agent0", 1.5)


class Examiner(Wobbly):
    def examine_together(self, episodes, policy):
        return [(episode.agent, policy) for episode in episodes]


@pytest.fixture
def aliased(make_study):
    """A study whose target calls its agents a0, a1, …"""

    def make(table=TABLE, **changes):
        target = make_study("plain") / "target.csv"
        folder = make_study("aliased", agents=table, **changes)
        (folder / "target.csv").write_text(target.read_text().replace("agent", "a").replace("a,", "agent,", 1))
        return folder

    return make


@pytest.mark.slow
def test_a_study_with_aliases_is_the_study_without_but_for_the_names(aliased, make_study):
    folder = aliased()
    named, plain = run_study(folder), run_study(make_study("plain"))
    assert [trial.score for trial in named.result.trials] == [trial.score for trial in plain.result.trials]
    assert named.best.assessment.inputs.agents == tuple(f"a{number}" for number in range(6))
    with sqlite3.connect(folder / "study.db") as db:
        assert {agent for (agent,) in db.execute("SELECT agent FROM episodes")} == {f"a{number}" for number in range(6)}
    assert named.document()["settings"]["aliases"]["a3"] == "agent3"


@pytest.mark.slow
def test_another_agent_behind_an_alias_is_another_study(aliased):
    run_study(aliased(budget="5"))
    changed = aliased(TABLE.replace('a5 = "agent5"', 'a5 = "agent0"'), budget="5")
    with pytest.raises(SettingsError, match=r'changed since the first trial: agents.a5 \(was "agent5"\); put it back'):
        run_study(changed)


def test_measuring_and_driving_know_the_aliases_and_an_unknown_agent_behind_one_is_told(aliased, tmp_path, answered):
    folder = aliased()
    (tmp_path / "model.toml").write_text("trim = 0.1\n")
    answered("measure", folder, "--model", tmp_path / "model.toml", "--output", tmp_path / "t.csv")
    assert (tmp_path / "t.csv").read_text().splitlines()[1].startswith("a0,0,")
    assert drive(folder, "a3").scores == drive(folder, "agent3").scores
    with pytest.raises(InputError, match=r"study.toml: agents.a5: no agent 'agnet5'; did you mean 'agent5'"):
        open_study(aliased(TABLE.replace('"agent5"', '"agnet5"')))
    with pytest.raises(InputError, match=r"agents.a5: must be text in quotes, got 5"):
        open_study(aliased(TABLE.replace('"agent5"', "5")))
