"""A scenario is refused before it runs if it makes no sense."""

import math

import pytest

from rfiddesign.floor import rectangle_floor
from rfiddesign.simulation.scenario import Routes, Scenario, World

FLOOR = rectangle_floor(3000.0, 3000.0, 300.0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Scenario(FLOOR, start="lost"), ("start", "'lost'", "known", "unknown")),
        (lambda: Scenario(FLOOR, dt_s=0.0), ("dt_s", "0.0", "0.0001")),
        (lambda: Scenario(FLOOR, duration_s=1e9), ("duration_s", "1000000000.0", "10000")),
        (lambda: Scenario(FLOOR, duration_s=math.nan), ("duration_s", "nan")),
        (lambda: Scenario(FLOOR, duration_s=10.0, settle_s=10.0), ("settle_s", "10.0", "9.95")),
        (lambda: World(installation_error_mm=-1.0), ("installation_error_mm", "-1.0", "0")),
        (lambda: World(dead_share=-0.01), ("dead_share", "-0.01", "at least 0", "at most 1")),
        (lambda: World(dead_share=1.5), ("dead_share", "1.5", "at least 0", "at most 1")),
        (lambda: World(dead_share=math.nan), ("dead_share", "nan")),
        (lambda: World(field_scale=0.4), ("field_scale", "0.4", "at least 0.5", "at most 2")),
        (lambda: World(field_scale=2.1), ("field_scale", "2.1", "at least 0.5", "at most 2")),
        (lambda: World(field_scale=math.inf), ("field_scale", "inf")),
        (lambda: Routes(speeds_mm_per_s=()), ("speeds_mm_per_s", "at least one")),
        (lambda: Routes(speeds_mm_per_s=(100.0, 0.0)), ("speeds_mm_per_s", "0.0", "above 0")),
        (lambda: Routes(aligned_share=1.5), ("aligned_share", "1.5", "1")),
        (lambda: Routes(headings=("sideways",)), ("headings", "sideways", "along", "constant")),
        (lambda: Routes(headings=()), ("headings", "along", "constant")),
        (lambda: Routes(turn_rate_rad_per_s=0.0), ("turn_rate_rad_per_s", "0.0", "0.001")),
    ],
)
def test_a_bad_argument_is_named_with_its_value_and_bound(make, words):
    with pytest.raises(ValueError, match=words[0]) as error:
        make()
    assert all(word in str(error.value) for word in words)
    assert "\n" not in str(error.value)


def test_steps_of_a_scenario():
    scenario = Scenario(FLOOR, duration_s=60.0, dt_s=0.05, settle_s=10.0)
    assert (scenario.n_steps, scenario.first_scored_step) == (1200, 200)
    assert Scenario(FLOOR, duration_s=1.0, dt_s=0.3, settle_s=0.7).first_scored_step == 2
