"""Another budget or other jobs than study.toml says, and nothing else."""

from dataclasses import replace

import pytest
from taught import make_taught

from proxytune.errors import InputError
from proxytune.study.spending import with_spending
from proxytune.study.study import facts, open_study


def test_only_what_is_given_changes_and_no_trial_depends_on_it(make_study):
    study = open_study(make_study())
    assert with_spending(study) == study
    other = with_spending(study, budget=40, jobs=3)
    assert (other.settings.budget, other.settings.jobs) == (40, 3)
    assert replace(other.settings, budget=7, jobs=1) == study.settings
    assert facts(other) == facts(study)


def test_a_search_for_learning_value_has_its_budget_elsewhere(make_study):
    study = open_study(make_taught(make_study, objective='"plv"', engine='"gp"'))
    with pytest.raises(InputError, match=r"study.toml: budget: .*set teaching.budget in this file instead"):
        with_spending(study, budget=4)
    assert with_spending(study, jobs=4).settings.jobs == 4
