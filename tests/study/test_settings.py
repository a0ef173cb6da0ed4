"""[families] in a study.toml: the same study of several domain families, each in a folder of its own."""

import pytest
from one_line import complaint_of
from several import make_several

from proxytune.errors import SettingsError
from proxytune.study import open_settings, open_study, read_study_settings, settings_document
from proxytune.study.settings import DEFAULT_FAMILY, StopRules, unnoticed

OTHER = '[families.own]\n[families.other]\nfamily = "schoolroom:schoolroom"\n[families.other.domain]\nblocked = 0.1\n'


def test_a_family_is_the_study_with_what_its_table_says_and_of_another_kind_knows_not_its_domain(make_study):
    own = '[families.a]\n[families.b]\nproxy = "wrong.toml"\n[families.b.domain]\nsleep = 0.5\n'
    folder = make_several(
        make_study, families=own + "[families.b.parameters]\ndelay = [0.1, 0.2]\n", domain={"version": '"2"'}
    )
    study = read_study_settings(folder)
    a, b = study.families["a"], study.families["b"]
    assert (study.home, a.home, b.home) == (folder, folder / "families" / "a", folder / "families" / "b")
    assert (a.name, b.name, a.folder) == ("wobbly_a", "wobbly_b", folder)
    assert dict(a.domain) == {"version": "2"}
    assert dict(b.domain) == {"version": "2", "sleep": 0.5}
    assert (a.space.names, b.space.names) == (("trim",), ("delay",))
    assert (a.proxy, b.proxy) == (None, folder / "wrong.toml")
    assert (a.seed, a.agents, a.targets, a.stop) == (study.seed, study.agents, study.targets, study.stop)
    changes = {"proxy": '"right.toml"', "truth": '"right.toml"', "domain": {"sleep": "0.0"}}
    study = read_study_settings(make_several(make_study, families=OTHER, **changes))
    own, other = study.families["own"], study.families["other"]
    assert (dict(own.domain), own.proxy is None, own.truth is None) == ({"sleep": 0.0}, False, False)
    assert (dict(other.domain), other.proxy, other.truth) == ({"blocked": 0.1}, None, None)


@pytest.mark.parametrize(
    ("families", "says"),
    [
        ("[families]\n", "families: comparing takes at least two families, got 0; add one, as in [families.planar]"),
        ("[families.a]\n", "families: comparing takes at least two families, got 1"),
        ("[families]\na = 3\nb = 4\n", "families.a: must be a table, written [families.a], got 3"),
        ('[families."../up"]\n[families.b]\n', "families.../up: is the name of a folder too; use up to 64 letters"),
        ('[families."a b"]\n[families.b]\n', "families.a b: is the name of a folder too"),
        ('[families.""]\n[families.b]\n', "families.: is the name of a folder too"),
        (f"[families.{'a' * 65}]\n[families.b]\n", "is the name of a folder too"),
        ("[families.a]\n[families.A]\n", "families: two names differ in nothing but capitals"),
        ("[families.a]\nplant = 1\n[families.b]\n", "families.a.plant: unknown key; known are: domain, family"),
        ("[families.a]\ndomain = 3\n[families.b]\n", "families.a.domain: must be a table"),
        ("[families.a]\nfamily = 3\n[families.b]\n", "families.a.family: must be text in quotes, got 3"),
        ("[families.a.parameters]\ntrim = 3\n[families.b]\n", "families.a: parameters.trim: must be [low, high]"),
    ],
)
def test_a_table_that_cannot_be_used_is_told_with_its_name(make_study, families, says):
    assert says in complaint_of(read_study_settings, make_several(make_study, families=families))


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"seconds": None}, "stop.wall_time_s: is missing; it is the time that each of families is tuned in [s]"),
        ({"seconds": 0.0}, "stop.wall_time_s: must be above 0, got 0"),
        ({"seconds": -3}, "stop.wall_time_s: must be above 0, got -3"),
        ({"confirm": "0"}, "confirm: is 0, and families are compared by fresh episodes; make it 1 or more"),
        ({"objective": '"plv"'}, "objective: 'plv' is not for families"),
    ],
)
def test_what_makes_families_incomparable_is_told(make_study, changes, says):
    assert f"study.toml: {says}" in complaint_of(read_study_settings, make_several(make_study, **changes))


@pytest.mark.parametrize(
    ("families", "says"),
    [
        ("[families.a]\n[families.b.parameters]\nblur = [0, 1]\n", "families.b: parameters.blur: unknown parameter"),
        ('[families.a]\n[families.b]\nfamily = "wobbly:wobly"\n', "families.b: family: family 'wobbly:wobly'"),
        ('[families.a]\n[families.b]\nproxy = "no.toml"\n', "families.b: proxy: no such file"),
        ('[families.a]\n[families.b]\nfamily = "few:few"\n', "families.b: agents: no agent 'agent5'"),
    ],
)
def test_what_one_family_cannot_do_is_told_with_its_name(make_study, families, says):
    folder = make_several(make_study, families=families)
    (folder / "few.py").write_text(FEW)
    assert says in complaint_of(lambda: [open_settings(one) for one in read_study_settings(folder).families.values()])


FEW = """
from proxytune.errors import SettingsError
from wobbly import Wobbly

class Few(Wobbly):
    def check_agent(self, name):
        if name == "agent5":
            raise SettingsError("no agent 'agent5'; take it out")

def few(domain, *, model):
    return Few()
"""


def test_the_folder_of_a_family_names_its_study_before_and_after_it_is_made(make_study, monkeypatch):
    folder = make_several(make_study)
    home = folder / "families" / "wrong"
    assert read_study_settings(home) == read_study_settings(folder).families["wrong"]
    home.mkdir(parents=True)
    assert read_study_settings(home) == read_study_settings(folder).families["wrong"]
    monkeypatch.chdir(home)
    assert open_study(home.relative_to(home)).settings.family_name == "wrong"
    with pytest.raises(SettingsError, match="families: has no 'rong', as .*rong is called; did you mean 'wrong'"):
        read_study_settings(folder / "families" / "rong")


def test_a_study_is_given_as_its_folder_or_its_file_also_in_one_of_a_family_s_name(make_study, tmp_path):
    make_several(make_study)
    (tmp_path / "study" / "families").mkdir()
    inner = make_study("study/families/right")
    assert read_study_settings(inner).family_name == ""
    assert read_study_settings(inner).home == inner
    folder = make_study()
    assert read_study_settings(folder) == read_study_settings(folder / "study.toml")


def test_what_is_written_is_what_is_read_and_what_may_be_left_out_has_a_default(make_study):
    settings = read_study_settings(make_study(jobs="2", batch="9", on_failure='"stop"', proxy='"m.toml"'))
    assert (settings.name, settings.starts, settings.budget, settings.initial) == ("wobbly", 3, 7, 5)
    assert (settings.seed, settings.jobs, settings.stop_on_failure) == (1, 2, True)
    assert [str(metric) for metric in settings.metrics] == ["distance:max", "survival_time:max"]
    assert settings.target == settings.folder / "target.csv"
    assert settings.proxy == settings.folder / "m.toml"
    assert settings_document(settings)["batch"] == settings.batch == 9, "more than the budget is fine"
    assert settings_document(settings)["on_failure"] == "stop"
    assert settings_document(settings)["preflight"] is settings.preflight is False
    assert settings.stop == StopRules()

    settings = read_study_settings(make_study(stop="{ wall_time_s = 60 }"))
    assert settings.stop == StopRules(wall_time_s=60.0)
    settings = read_study_settings(make_study(stop="{ no_improvement = 0.2 }"))
    assert settings.stop == StopRules(no_improvement=0.2)
    assert settings_document(settings)["stop"] == {"no_improvement": 0.2}
    left_out = dict.fromkeys(
        ("name", "family", "initial", "batch", "engine", "seed", "jobs", "preflight", "confirm", "cut_off")
    )
    settings = read_study_settings(make_study("mine", **left_out))
    assert (settings.name, settings.family, settings.proxy) == ("mine", DEFAULT_FAMILY, None)
    assert settings.batch == 1
    assert (settings.initial, settings.seed, settings.jobs, settings.stop_on_failure) == (8, 1, 1, False)
    assert (settings.engine, settings.preflight, settings.confirm, settings.cut_off) == ("outcomes", True, 1, True)
    assert read_study_settings(make_study("plv", objective='"plv"', engine=None)).engine == "gp"


BAD = {
    "an unknown key": ({"bugdet": "5"}, "bugdet: unknown key; did you mean 'budget'?"),
    "a missing key": ({"budget": None}, "budget: is missing"),
    "a number as text": ({"budget": '"many"'}, "budget: must be a whole number, got 'many'"),
    "a fraction": ({"starts": "2.5"}, "starts: must be a whole number"),
    "no budget": ({"budget": "0"}, "budget: is 0, and nothing is known"),
    "no start": ({"starts": "0"}, "starts: must be between 1 and"),
    "no trial at all in a batch": ({"batch": "0"}, "batch: must be between 1 and"),
    "half a trial more in a batch": ({"batch": "1.5"}, "batch: must be a whole number"),
    "no job": ({"jobs": "0"}, "jobs: must be between 1 and"),
    "a negative seed": ({"seed": "-1"}, "seed: must be between 0 and"),
    "one agent": ({"agents": '["agent0"]'}, "agents: comparing takes at least two agents, got 1"),
    "an agent twice": ({"agents": '["agent0", "agent0"]'}, "agents: names something twice"),
    "agents as a text": ({"agents": '"agent0"'}, "agents: must be a list of texts"),
    "no metric": ({"metrics": "[]"}, "metrics: is empty"),
    "a metric without direction": ({"metrics": '["distance"]'}, "metrics: metric 'distance': write NAME:max"),
    "the same metric": ({"metrics": '["distance:max", "distance:max"]'}, "study.toml: metrics: names something twice"),
    "a metric twice": ({"metrics": '["distance:max", "distance:min"]'}, "metrics: names a metric twice"),
    "an unknown rule": ({"on_failure": '"stopp"'}, "on_failure: unknown value 'stopp'; did you mean 'stop'?"),
    "unknown rule to stop": ({"stop": "{ wall_time = 5 }"}, "stop.wall_time: unknown key; did you mean 'wall_time_s'"),
    "no time at all": ({"stop": "{ wall_time_s = 0 }"}, "stop.wall_time_s: must be above 0, got 0; remove it"),
    "a negative gain": ({"stop": "{ no_improvement = -1 }"}, "stop.no_improvement: must be above 0, got -1"),
    "a word for a flag": ({"preflight": '"no"'}, "preflight: must be true or false, without quotes, got 'no'"),
    "less than no repetition": ({"confirm": "-1"}, "confirm: must be between 0 and 1000, got -1"),
    "stop as a number": ({"stop": "5"}, "stop: must be a table"),
    "no format": ({"format": None}, "format: is missing"),
    "a later format": ({"format": "2"}, "format: this proxytune reads up to 1; install a newer one"),
    "no parameters": ({"parameters": {}}, "parameters: is missing"),
    "bounds that rounding makes one": (
        {"parameters": {"trim": "[0.1, 0.10000000000000002]"}},
        "parameters.trim: bounds must be further apart than rounding",
    ),
    "bounds infinitely far": ({"parameters": {"trim": "[-1e308, 1e308]"}}, "and not infinitely far"),
    "a bound as text": ({"parameters": {"trim": '["a", 1]'}}, "parameters.trim: must be [low, high]"),
}


@pytest.mark.parametrize(("changes", "expected"), BAD.values(), ids=BAD)
def test_every_mistake_gets_one_line_with_file_and_key(make_study, changes, expected):
    folder = make_study(**changes)
    told = complaint_of(read_study_settings, folder)
    assert told.startswith(f"{folder / 'study.toml'}: ")
    assert expected in told
    assert told.count("study.toml: ") == 1


def put(folder, *names):
    for name in names:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(b"1")


def test_weights_beside_modules_are_named_in_one_line_and_of_many_some(make_study, tmp_path):
    folder = make_study()
    put(folder, "mine.py", "net.ONNX", "pack/weights.npz")
    (caution,) = open_study(folder).cautions
    assert caution.startswith("net.ONNX, pack/weights.npz: if agents read this, a change in it is not noticed; ")
    assert "\n" not in caution
    put(tmp_path, "mine.py", *(f"net{number}.pt" for number in range(5)))
    assert unnoticed(tmp_path)[0].startswith("net0.pt, net1.pt, net2.pt and 2 more: ")


@pytest.mark.parametrize(
    "names",
    [
        ("net.pt",),
        ("mine.py", "target.csv", "notes.txt"),
        ("mine.py", "teaching/exam-1.npz", "rescored/a.npz"),
        ("mine.py", ".hidden.npz"),
    ],
)
def test_nothing_is_said_where_no_module_could_read_weights_or_there_are_none(tmp_path, names):
    put(tmp_path, *names)
    assert unnoticed(tmp_path) == ()
