import pytest

from proxytune.errors import SettingsError
from proxytune.study.settings import DEFAULT_FAMILY, StopRules, as_document, read_study_settings


def test_a_study_is_given_as_its_folder_or_its_file(make_study):
    folder = make_study()
    assert read_study_settings(folder) == read_study_settings(folder / "study.toml")


def test_what_is_written_is_what_is_read(make_study):
    settings = read_study_settings(make_study(jobs="2", batch="9", on_failure='"stop"', proxy='"m.toml"'))
    assert (settings.name, settings.starts, settings.budget, settings.initial) == ("wobbly", 3, 7, 5)
    assert (settings.seed, settings.jobs, settings.stop_on_failure) == (1, 2, True)
    assert [str(metric) for metric in settings.metrics] == ["distance:max", "survival_time:max"]
    assert settings.target == settings.folder / "target.csv"
    assert settings.proxy == settings.folder / "m.toml"
    assert as_document(settings)["batch"] == settings.batch == 9, "more than the budget is fine"
    assert as_document(settings)["on_failure"] == "stop"
    assert as_document(settings)["preflight"] is settings.preflight is False
    assert settings.stop == StopRules()


def test_what_may_be_left_out_has_a_default(make_study):
    left_out = dict.fromkeys(
        ("name", "family", "initial", "batch", "engine", "seed", "jobs", "preflight", "confirm", "cut_off")
    )
    settings = read_study_settings(make_study("mine", **left_out))
    assert (settings.name, settings.family, settings.proxy) == ("mine", DEFAULT_FAMILY, None)
    assert settings.batch == 1
    assert (settings.initial, settings.seed, settings.jobs, settings.stop_on_failure) == (8, 1, 1, False)
    assert (settings.engine, settings.preflight, settings.confirm, settings.cut_off) == ("outcomes", True, 1, True)


def test_of_learning_value_nothing_is_known_but_the_score_so_its_default_engine_is_that_of_scores(make_study):
    assert read_study_settings(make_study("plv", objective='"plv"', engine=None)).engine == "gp"


def test_rules_to_stop_are_read_each_on_its_own(make_study):
    settings = read_study_settings(make_study(stop="{ wall_time_s = 60 }"))
    assert settings.stop == StopRules(wall_time_s=60.0)
    settings = read_study_settings(make_study(stop="{ no_improvement = 0.2 }"))
    assert settings.stop == StopRules(no_improvement=0.2)
    assert as_document(settings)["stop"] == {"no_improvement": 0.2}


@pytest.mark.parametrize("engine", ["gp", "composite", "random", "sobol", "tpe"])
def test_a_study_names_its_engine(make_study, engine):
    assert as_document(read_study_settings(make_study(engine=f'"{engine}"')))["engine"] == engine


def test_the_box_does_not_depend_on_the_order_of_its_lines(make_study):
    one = read_study_settings(make_study(parameters={"trim": "[-0.3, 0.3]", "delay": "[0, 0.3]"}))
    other = read_study_settings(make_study(parameters={"delay": "[0, 0.3]", "trim": "[-0.3, 0.3]"}))
    assert one.space == other.space


BAD = {
    "an unknown key": ({"bugdet": "5"}, "bugdet: unknown key; did you mean 'budget'?"),
    "a missing key": ({"budget": None}, "budget: is missing"),
    "a missing target": ({"target": None}, "target: is missing"),
    "a number as text": ({"budget": '"many"'}, "budget: must be a whole number, got 'many'"),
    "a fraction": ({"starts": "2.5"}, "starts: must be a whole number"),
    "no budget": ({"budget": "0"}, "budget: must be between 1 and"),
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
    "a metric twice": ({"metrics": '["distance:max", "distance:min"]'}, "metrics: names a metric twice"),
    "an unknown rule": ({"on_failure": '"stopp"'}, "on_failure: unknown value 'stopp'; did you mean 'stop'?"),
    "an unknown rule to stop": (
        {"stop": "{ wall_time = 5 }"},
        "stop.wall_time: unknown key; did you mean 'wall_time_s'",
    ),
    "no time at all": ({"stop": "{ wall_time_s = 0 }"}, "stop.wall_time_s: must be above 0, got 0; remove it"),
    "a negative gain": ({"stop": "{ no_improvement = -1 }"}, "stop.no_improvement: must be above 0, got -1"),
    "a word for a flag": ({"preflight": '"no"'}, "preflight: must be true or false, without quotes, got 'no'"),
    "less than no repetition": ({"confirm": "-1"}, "confirm: must be between 0 and 1000, got -1"),
    "stop as a number": ({"stop": "5"}, "stop: must be a table"),
    "no format": ({"format": None}, "format: is missing"),
    "a later format": ({"format": "2"}, "format: this proxytune reads up to 1; install a newer one"),
    "no parameters": ({"parameters": {}}, "parameters: is missing"),
    "bounds reversed": ({"parameters": {"trim": "[0.3, -0.3]"}}, "parameters.trim: the lower bound must be below"),
    "bounds equal": ({"parameters": {"trim": "[0.3, 0.3]"}}, "parameters.trim: the lower bound must be below"),
    "one bound": ({"parameters": {"trim": "[0.3]"}}, "parameters.trim: must be [low, high]"),
    "a NaN bound": ({"parameters": {"trim": "[nan, 0.3]"}}, "parameters.trim: bounds must be finite"),
    "an infinite bound": ({"parameters": {"trim": "[0, inf]"}}, "parameters.trim: bounds must be finite"),
    "a bound as text": ({"parameters": {"trim": '["a", 1]'}}, "parameters.trim: must be [low, high]"),
}


@pytest.mark.parametrize("case", BAD)
def test_every_mistake_gets_one_line_with_file_and_key(make_study, case):
    changes, expected = BAD[case]
    folder = make_study(**changes)
    with pytest.raises(SettingsError) as told:
        read_study_settings(folder)
    assert str(told.value).startswith(f"{folder / 'study.toml'}: ")
    assert expected in str(told.value)
    assert "\n" not in str(told.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(SettingsError, match=r"study\.toml: no such file"):
        read_study_settings(tmp_path)


def test_a_file_that_is_not_toml_is_told_with_its_line(tmp_path):
    (tmp_path / "study.toml").write_text("format = 1\nbudget = = 3\n")
    with pytest.raises(SettingsError, match=r"is not valid TOML: .*line 2"):
        read_study_settings(tmp_path)
