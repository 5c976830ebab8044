"""What a study may ask over drives and in several scenarios, and how a run is scored."""

from dataclasses import replace

import numpy as np
import pytest

from rfiddesign.errors import StudyError
from rfiddesign.metrics import Requirement, RunMetrics
from rfiddesign.optimize import MeanCriterion, ShareCriterion
from rfiddesign.study import load_study
from rfiddesign.study.criteria import Criteria, further_limit
from rfiddesign.study.requirements_config import FurtherRequirement

RUN = RunMetrics(10.0, 12.0, 20.0, 40.0, 0.01, 0.012, 0.02, 0.04, 2.0, 0.0, 100)
REQUIREMENT = Requirement((("position_p95_mm", 30.0),))


def limit(**fields):
    return further_limit(FurtherRequirement(**fields))


def test_one_share_in_one_scenario_is_scored_as_passed_or_not():
    criteria = Criteria(REQUIREMENT, 0.95, 0.9)
    assert criteria.declared() == ()
    found = criteria.scores([[RUN, replace(RUN, position_p95_mm=31.0), replace(RUN, is_complete=False)]])
    assert found.dtype == bool
    assert found.tolist() == [True, False, False]


def test_a_mean_is_scored_as_a_share_of_its_cap():
    mean = limit(kind="mean", metric="position_mean_mm", limit=12.0)
    assert mean.criterion("m") == MeanCriterion("m", 0.9 / 4, 1 / 4)
    assert mean.score(RUN) == 10 / 48
    assert mean.score(replace(RUN, position_mean_mm=1000.0)) == 1.0
    assert mean.score(replace(RUN, is_complete=False)) == 1.0
    mean = limit(kind="mean", metric="convergence_s", limit=5.0, hold_limit=4.0, cap=10.0)
    assert mean.criterion("m") == MeanCriterion("m", 0.4, 0.5)
    assert mean.score(replace(RUN, convergence_s=float("inf"))) == 1.0


def test_a_root_mean_square_is_a_mean_of_squares():
    """Over drives that measured 6 and 8 mm it is the root of 50, and scores average to that."""
    rms = limit(kind="rms", metric="position_rms_mm", limit=10.0)
    scores = [rms.score(replace(RUN, position_rms_mm=value)) for value in (6.0, 8.0)]
    assert np.sqrt(np.mean(scores)) * rms.cap == pytest.approx(np.sqrt(50))
    assert rms.criterion("r").fail == 0.25


def test_a_quantile_is_a_share_of_drives():
    quantile = limit(kind="quantile", metric="heading_max_deg", limit=3.0, quantile=0.8)
    assert quantile.criterion("q") == ShareCriterion("q", 0.9, 0.8)
    assert quantile.score(replace(RUN, heading_max_rad=np.radians(2.99))) == 1.0
    assert quantile.score(replace(RUN, heading_max_rad=np.radians(3.01))) == 0.0
    assert quantile.scaled(2.0).score(replace(RUN, heading_max_rad=np.radians(5.9))) == 1.0


def test_everything_is_asked_in_every_scenario():
    mean = limit(kind="mean", metric="position_mean_mm", limit=12.0)
    criteria = Criteria(REQUIREMENT, 0.95, 0.9, (mean,), ("base", "worn"))
    names = [criterion.name for criterion in criteria.declared()]
    assert names[0] == "base: drives pass"
    assert names[3].startswith("worn: mean over drives of position_mean_mm below 12")
    scores = criteria.scores([[RUN, RUN], [RUN, replace(RUN, position_p95_mm=99.0)]])
    assert scores.tolist() == [[1.0, 10 / 48, 1.0, 10 / 48], [1.0, 10 / 48, 0.0, 10 / 48]]


SCENARIO = "scenarios=[{name = 'worn', set = {'world.dead_share' = 0.2, 'speeds_mm_per_s' = [100.0]}}]"


def test_a_scenario_changes_the_world_and_the_drives_and_not_the_filter(tiny):
    study = load_study(tiny, (SCENARIO,))
    ((name, file),) = study.further
    assert name == "worn"
    assert (file.world.dead_share, file.scenario.speeds_mm_per_s) == (0.2, [100.0])
    assert (study.file.world.dead_share, study.criteria.scenarios) == (0.0, ("base", "worn"))


@pytest.mark.parametrize(
    ("setting", "line"),
    [
        ("scenarios=[{name = 'worn', set = {seed = 3}}]", "scenario 'worn': seed: must be a key of scenario or world"),
        ("scenarios=[{name = 'worn', set = {'world.dead_share' = 3.0}}]", "scenario 'worn': world.dead_share: "),
        ("scenarios=[{name = 'worn', set = {'world.dust' = 3.0}}]", "world.dust: unknown key"),
        ("scenarios=[{name = 'base', set = {'world.dead_share' = 0.1}}]", "two are named 'base'"),
        ("scenarios=[{name = 'worn', set = {}}]", "scenarios.0.set"),
        ("requirements=[{kind = 'mean', metric = 'speed', limit = 3.0}]", "requirements.0.metric"),
        ("requirements=[{kind = 'mean', metric = 'lost_share', limit = 0.1, cap = 0.1}]", "cap must be above limit"),
        ("requirements=[{kind = 'mean', metric = 'lost_share', limit = 0.1, hold_limit = 0.2}]", "hold_limit must be"),
        ("requirements=[{kind = 'mean', metric = 'lost_share', limit = 0.1, quantile = 0.2}]", "quantile is not for"),
        ("requirements=[{kind = 'quantile', metric = 'lost_share', limit = 0.1}]", "needs quantile"),
        ("requirements=[{kind = 'quantile', metric = 'lost_share', limit = 0.1, quantile = 0.5, hold_quantile = 0.5}]",
         "hold_quantile must be above"),
        ("search.assume=['more tags']", "search.assume.0"),
        ("search.assume=['fewer tags', 'fewer tags']", "must not name an assumption twice"),
        ("search.budget_runs=0", "search.budget_runs"),
        ("search.cost_tolerance=-0.1", "search.cost_tolerance"),
    ],
)  # fmt: skip
def test_what_cannot_be_asked_is_one_line(tiny, setting, line):
    with pytest.raises(StudyError) as error:
        load_study(tiny, (setting,))
    assert line in str(error.value)
    assert "\n" not in str(error.value)
