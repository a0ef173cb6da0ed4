"""`study` of several families: which simulator, and for what? `plot` draws that again."""

import json
import shutil
from contextlib import nullcontext
from pathlib import Path

import pytest
from one_line import complaint_of
from several import make_several
from stopping import Stopping
from taught import make_taught_families

from proxytune.api import read_families, run_opened_families
from proxytune.api.families import run_families
from proxytune.cli.main import main
from proxytune.running import Silent
from proxytune.study import read_study_settings

FAST = "[families.fast]\n[families.slow.domain]\nsleep = 0.02\n"
THIS_RUN = ("episodes", "seconds")
"""What differs when a study is run again."""


def copied(folder, home):
    """A finished study of one's own."""
    return Path(shutil.copytree(folder, home / "study"))


def without_this_run(document):
    return {key: value for key, value in document.items() if key not in THIS_RUN}


def without_costs(document):
    """What does not depend on how long anything took."""
    for one in document["families"].values():
        for key in ("seconds", "seconds_per_episode", "seconds_per_episode_interval"):
            del one[key]
    return {key: value for key, value in document.items() if key not in ("sentence", "best", *THIS_RUN)}


@pytest.fixture(scope="module")
def journal(tmp_path_factory):
    return tmp_path_factory.mktemp("kept") / "journal"


@pytest.fixture(scope="module")
def finished(make_studies, journal):
    """A finished study of two families, whose episodes are in the journal."""
    folder = make_several(make_studies, domain={"journal": f'"{journal}"'})
    run_families(folder)
    return folder


@pytest.mark.slow
def test_the_family_that_the_target_is_an_instance_of_predicts_best_and_the_document_has_its_keys(finished, answered):
    document = answered("study", finished)
    assert document["best"]["predict"] == {"family": "right", "cannot_be_told_from": []}
    right, wrong = document["families"]["right"], document["families"]["wrong"]
    (difference,) = document["differences"]
    assert difference["difference"] == wrong["fresh"]["prpv"] - right["fresh"]["prpv"] > 0
    assert difference["interval"][0] > 0
    assert difference["beyond_noise"] is True
    assert document["sentence"].startswith("To predict: right, fresh PRPV (proxy relative predictivity value) ")
    assert "worse: wrong +" in document["sentence"]
    assert {"sentence", "best", "families", "differences", "seconds_per_family", "settings"} <= set(document)
    keys = {"theta", "prpv", "fresh", "plv", "seconds_per_episode", "trials", "seconds", "folder"}
    assert all(keys <= set(one) for one in document["families"].values())
    assert {"prpv", "prpv_interval"} <= set(right["fresh"])
    assert document["best"]["teach"] is None
    assert document["report"] == str(finished / "report.html")
    assert document["figures"] == [str(finished / "figures" / "families.png")]
    page = (finished / "report.html").read_text()
    assert "To predict: right" in page
    assert "refresh" not in page


@pytest.mark.slow
def test_a_family_is_what_its_study_alone_would_be(finished, make_study, answered):
    document = answered("study", finished)
    alone = make_study("alone", parameters={"trim": "[-0.3, 0.3]"}, confirm="1", proxy='"held.toml"')
    (alone / "held.toml").write_text("delay = 0.3\n")
    own = answered("study", alone)
    wrong = document["families"]["wrong"]
    assert wrong["theta"] == own["best"]["theta"]
    assert wrong["fresh"]["prpv"] == own["best"]["fresh"]["prpv"]
    assert wrong["fresh"]["prpv_interval"] == own["best"]["fresh"]["prpv_interval"]
    assert wrong["trials"] == len(own["trials"])


@pytest.mark.slow
def test_a_finished_one_is_summed_up_again_and_drawn_again_without_simulating(finished, journal, tmp_path, answered):
    folder = copied(finished, tmp_path)
    driven = journal.read_text()
    first = answered("study", folder)
    made = [folder / "report.html", folder / "figures" / "families.png"]
    for path in made:
        path.unlink()
    assert first["episodes"] == {"run": 0}
    assert without_this_run(first) == answered("plot", folder)
    assert journal.read_text() == driven
    assert all(path.exists() for path in made)


@pytest.mark.slow
def test_a_time_once_spent_stays_spent_and_a_longer_one_goes_on(make_study, capsys, answered):
    folder = make_several(
        make_study, families=FAST, seconds=0.3, parameters={"trim": "[-0.3, 0.3]", "delay": "[0.0, 0.3]"}
    )
    first = answered("study", folder)
    fast, slow = first["families"]["fast"], first["families"]["slow"]
    # One trial of 18 episodes takes the slow one 0.36 s.
    assert slow["trials"] == 1 < fast["trials"]
    assert slow["seconds"] >= 0.3
    assert "wall_time_s is 0.3" in slow["stopped"]
    assert answered("study", folder)["families"] == first["families"]
    assert main(["plot", str(folder)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "slow: 1 of the 5 trials of the design were run in its time: its θ is hardly tuned" in said
    path = folder / "study.toml"
    path.write_text(path.read_text().replace("wall_time_s = 0.3", "wall_time_s = 0.6"))
    more = answered("study", folder)["families"]["slow"]
    assert more["trials"] == 2
    assert more["seconds"] > slow["seconds"]


@pytest.mark.slow
@pytest.mark.parametrize(("family", "episodes"), [("right", 130), ("wrong", 40)])
def test_stopped_anywhere_it_goes_on_to_the_same_document(finished, journal, make_study, family, episodes, answered):
    folder = make_several(make_study, domain={"journal": f'"{journal}"'})

    def pressing_ctrl_c(study):
        return nullcontext(Stopping(episodes) if study.settings.family_name == family else Silent())

    with pytest.raises(KeyboardInterrupt):
        run_opened_families(read_study_settings(folder), lambda line: None, pressing_ctrl_c, progress=False)
    there, here = (without_costs(answered("study", one)) for one in (finished, folder))
    assert json.loads(json.dumps(there).replace(str(finished), str(folder))) == here


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("plot {}", "run the study first: python -m proxytune study"),
        *(
            (words, "one is needed; give one, as")
            for words in ("sweep {} --parameter trim", "teach {}", "repair {}", "export {} --to skopt --output x")
        ),
    ],
)
def test_a_command_of_one_study_says_which_to_give_and_plot_what_to_run(make_study, words, says, refused):
    folder = make_several(make_study)
    assert f"{says} {folder / 'families' / 'right'}" in refused(*words.format(folder).split())


@pytest.mark.parametrize("place", ["", "families/right"])
def test_loop_is_of_a_study_without_families(make_study, place, refused):
    said = refused("loop", make_several(make_study) / place)
    assert "families: `loop` is of one family; give it a study without this table" in said


@pytest.mark.slow
def test_every_command_takes_the_folder_of_one_family(finished, capsys):
    one = str(finished / "families" / "wrong")
    assert main(["plot", one]) == main(["repair", one]) == main(["study", one]) == 0
    assert main(["sweep", one, "--parameter", "trim", "--points", "2"]) == 0
    assert (finished / "families" / "wrong" / "figures" / "sweep_trim.png").exists()
    assert not (finished / "study.db").exists()


@pytest.mark.parametrize("link", ["families", "families/right"])
def test_a_link_in_the_place_of_a_familys_folder_is_refused(make_study, tmp_path, link, refused):
    folder, elsewhere = make_several(make_study), tmp_path / "elsewhere"
    (elsewhere / "right").mkdir(parents=True)
    (folder / link).parent.mkdir(exist_ok=True)
    (folder / link).symlink_to(elsewhere)
    for path in (folder, folder / "families" / "right"):
        assert f"{link}: is a symbolic link" in refused("study", path, status=1)
    assert not list(elsewhere.glob("**/*.db"))


def test_a_mistake_in_the_last_family_or_that_it_cannot_teach_is_told_before_the_first_is_tuned(make_study, refused):
    folder = make_several(make_study, families="[families.a]\n[families.b.domain]\nslep = 1\n")
    assert "study.toml: families.b: domain.slep: unknown key; did you mean 'sleep'?" in refused("study", folder)
    assert not (folder / "families").exists()
    folder = make_taught(make_study, '[families.right]\n[families.mute]\nfamily = "wobbly:wobbly"\n')
    assert "study.toml: families.mute: family: wobbly:wobbly cannot teach: it lacks" in refused("study", folder)
    assert not (folder / "families").exists()


@pytest.mark.slow
def test_a_family_in_which_nothing_works_is_named(make_study, capsys):
    faults = ", ".join(f'"agent{number}:*:raises"' for number in range(6))
    folder = make_several(make_study, families=f"[families.a]\n[families.b.domain]\nfaults = [{faults}]\n")
    assert main(["study", str(folder)]) == 1
    assert "proxytune study: families.b: " in capsys.readouterr().err
    assert (folder / "families" / "a" / "study.db").exists()


@pytest.mark.slow
def test_what_changed_since_is_told_with_the_family_and_its_database(finished, tmp_path, capsys):
    folder = copied(finished, tmp_path)
    path = folder / "study.toml"
    path.write_text(f"{path.read_text()}[families.wrong.domain]\nversion = '2'\n")
    assert main(["study", str(folder)]) == 2
    said = capsys.readouterr().err
    assert "study.toml: families.wrong: changed since the first trial: domain.version" in said
    assert str(folder / "families" / "wrong" / "study.db") in said


@pytest.mark.slow
def test_from_python_one_asks_the_same(finished):
    report = read_families(finished)
    assert report.spent.episodes == 0
    assert report.sentence == report.document()["sentence"]
    assert set(report.studies) == {"right", "wrong"}
    assert report.studies["right"].theta == report.document()["families"]["right"]["theta"]
    assert "families: is missing; name two at least" in complaint_of(run_families, finished / "families" / "right")


def make_taught(make_study, families):
    """A study of families that teach."""
    own = {"twin": "trim = 0.1\ndelay = 0.12\n", "called": "taught", "proxy": '"right.toml"'}
    return make_taught_families(make_study, families, grid=[0, 20, 40, 80, 160, 320], **own)


@pytest.fixture(scope="module")
def taught(make_studies):
    """A finished study of two schoolrooms, of which the second cannot come near the target."""
    folder = make_taught(make_studies, "[families.right]\n[families.far.parameters]\ntrim = [-0.3, -0.29]\n")
    run_families(folder)
    return folder


@pytest.mark.slow
def test_where_there_is_teaching_each_teaches_at_its_best_theta(taught, answered):
    document = answered("study", taught)
    right, far = document["families"]["right"], document["families"]["far"]
    assert right["plv"] > far["plv"]
    assert right["plv_interval"][0] <= right["plv"] <= right["plv_interval"][1]
    # Medians of the same draws: not quite additive.
    assert far["more"]["value"] == pytest.approx(right["plv"] - far["plv"], abs=15.0)
    assert document["best"]["teach"]["family"] == "right"
    assert "To teach: " in document["sentence"]
    assert answered("plot", taught) == without_this_run(document)


@pytest.mark.slow
def test_lessons_of_another_theta_or_that_are_none_are_not_shown(taught, tmp_path, refused, answered):
    folder = copied(taught, tmp_path)
    lessons = folder / "families" / "lessons.json"
    known = json.loads(lessons.read_text())
    known["far"]["theta"]["trim"] = 0.0
    lessons.write_text(json.dumps(known))
    drawn = answered("plot", folder)["families"]
    assert drawn["right"]["plv"] is not None
    assert drawn["far"]["plv"] is None
    lessons.write_text("{]")
    assert "lessons.json: is not as proxytune writes it; delete it" in refused("plot", folder, status=1)
