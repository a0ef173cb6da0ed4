"""[families] in a study.toml: the same study of several domain families, each in a folder of its own."""

import pytest
from several import make_several

from proxytune.errors import SettingsError
from proxytune.study.settings import read_study_settings
from proxytune.study.study import open_settings, open_study

OTHER = '[families.own]\n[families.other]\nfamily = "schoolroom:schoolroom"\n[families.other.domain]\nblocked = 0.1\n'


def test_a_family_is_the_study_with_what_its_table_says(make_study):
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


def test_another_domain_family_knows_nothing_of_the_studys_domain_proxy_and_truth(make_study):
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
        (
            "[families.a.parameters]\ntrim = 3\n[families.b]\n",
            "families.a: parameters.trim: must be [low, high]",
        ),
    ],
)
def test_a_table_that_cannot_be_used_is_told_with_its_name(make_study, families, says):
    folder = make_several(make_study, families=families)
    with pytest.raises(SettingsError) as told:
        read_study_settings(folder)
    assert says in str(told.value)
    assert "\n" not in str(told.value)


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
    with pytest.raises(SettingsError, match="study.toml: ") as told:
        read_study_settings(make_several(make_study, **changes))
    assert says in str(told.value)


@pytest.mark.parametrize(
    ("families", "says"),
    [
        (
            "[families.a]\n[families.b.domain]\nslep = 1\n",
            "families.b: domain.slep: unknown key; did you mean 'sleep'?",
        ),
        ("[families.a]\n[families.b.parameters]\nblur = [0, 1]\n", "families.b: parameters.blur: unknown parameter"),
        ('[families.a]\n[families.b]\nfamily = "wobbly:wobly"\n', "families.b: family: family 'wobbly:wobly'"),
        ('[families.a]\n[families.b]\nproxy = "no.toml"\n', "families.b: proxy: no such file"),
        ('[families.a]\n[families.b]\nfamily = "few:few"\n', "families.b: agents: no agent 'agent5'"),
    ],
)
def test_what_one_family_cannot_do_is_told_with_its_name(make_study, families, says):
    folder = make_several(make_study, families=families)
    (folder / "few.py").write_text(FEW)
    with pytest.raises(SettingsError) as told:
        for one in read_study_settings(folder).families.values():
            open_settings(one)
    assert says in str(told.value)


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


def test_a_study_in_a_folder_of_that_name_is_a_study_of_its_own(make_study, tmp_path):
    make_several(make_study)
    (tmp_path / "study" / "families").mkdir()
    inner = make_study("study/families/right")
    assert read_study_settings(inner).family_name == ""
    assert read_study_settings(inner).home == inner


def test_where_one_study_is_needed_several_are_refused_with_what_to_give(make_study):
    folder = make_several(make_study)
    with pytest.raises(SettingsError, match=f"one is needed; give one, as {folder / 'families' / 'right'}"):
        open_study(folder)
