import pytest

from proxytune.errors import InputError
from proxytune.study.family import load_family
from proxytune.study.settings import read_study_settings


def load(folder):
    settings = read_study_settings(folder)
    return load_family(settings, settings.proxy)


def test_a_factory_gets_the_domain_table_and_the_model(make_study):
    folder = make_study(domain={"version": '"7"'}, proxy='"model.toml"')
    (folder / "model.toml").write_text("trim = 0.2\n")
    family = load(folder)
    assert (family.version, family.theta) == ("7", (("trim", 0.2),))


def test_modules_in_the_study_s_folder_can_be_imported(make_study):
    folder = make_study(family='"my_own_family:make"')
    (folder / "my_own_family.py").write_text("from wobbly import wobbly as make\n")
    assert load(folder).starts == 5


BAD = {
    "no colon": ({"family": '"wobbly"'}, "family: family 'wobbly' is unknown (your own is written module:attribute)"),
    "no such module": ({"family": '"wobbli:wobbly"'}, "family 'wobbli:wobbly': no module 'wobbli' in "),
    "no such factory": (
        {"family": '"wobbly:wobly"'},
        "'wobbly:wobly': wobbly has no 'wobly'; did you mean 'wobbly'?",
    ),
    "a factory with a bug": (
        {"family": '"wobbly:broken_factory"'},
        "raised KeyError: 'robot' (wobbly.py, line 114); correct it",
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


@pytest.mark.parametrize("case", BAD)
def test_every_mistake_gets_one_line_with_file_and_key(make_study, case):
    changes, expected = BAD[case]
    with pytest.raises(InputError) as told:
        load(make_study(**changes))
    assert expected in str(told.value)
    assert "study.toml: " in str(told.value)
    assert "\n" not in str(told.value)


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
    "parameters": (
        "parameters = property(lambda self: 1 / 0)",
        "parameters of faulty_{n}:make raised ZeroDiv",
    ),
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
    with pytest.raises(InputError) as told:
        load(folder)
    assert f"study.toml: family: {expected.format(n=number)}" in str(told.value).replace("parameters['delay'] ", "")
    assert "\n" not in str(told.value)


def test_an_agent_check_that_raises_is_told_with_the_family_s_name(make_study):
    folder = make_study(family='"checks_badly:make"')
    text = "from wobbly import Wobbly, wobbly\n\n\n"
    text += "class Bad(Wobbly):\n    def check_agent(self, name): import not_there\n\n\n"
    text += "def make(domain, *, model):\n    return Bad(**vars(wobbly(domain, model=model)))\n"
    (folder / "checks_badly.py").write_text(text)
    expected = r"check_agent\('agent0'\) of checks_badly:make raised ModuleNotFoundError: .*not_there.*; correct it"
    with pytest.raises(InputError, match=expected):
        load(folder)


def test_a_module_that_cannot_be_imported_is_told(make_study):
    folder = make_study(family='"falls_over:make"')
    (folder / "falls_over.py").write_text("1 / 0\n")
    with pytest.raises(InputError, match="importing falls_over raised ZeroDivisionError: division by zero"):
        load(folder)
