"""The study of estimators against what is not as they believe: its grid, and what a few runs tell."""

import math
from functools import cache

import pytest

from rfiddesign.reproduce import load_reproduction, reproduce
from rfiddesign.reproduce.cases import case_of

NAME = "estimator-robustness"
TABLES = ("8x100", "8x16", "4x25", "1x16", "navifloor", "navifloor-rssi")


def loaded():
    return load_reproduction(NAME)


@cache
def quick():
    found = reproduce(loaded(), is_quick=True, n_workers=2)
    return found, {(row.table, row.row, row.metric): row.measured for row in found.rows}


def test_conditions_change_the_world_and_nothing_else():
    (grid,) = loaded().file.grids
    assert tuple(grid.tables) == TABLES
    assert len(grid.estimators) == 8
    assert len(grid.conditions) == 12
    for changes in grid.conditions.values():
        assert all(key.startswith("world.") for key in changes)
    assert not grid.conditions["matched"]
    # All at once is each at once, with tags off by 10 mm.
    single = ("tags 10 mm", "dead 5 %", "missed 5 %", "radius -10 %", "delay 25 ms", "odometry scale")
    together = {key: value for name in single for key, value in grid.conditions[name].items()}
    assert grid.conditions["all"] == together
    assert grid.conditions["all, delay compensated"] == together | {"world.is_delay_known": True}


def test_filters_with_the_field_are_told_their_tolerances_and_filters_without_rssi_do_without():
    study = loaded()
    cases = {(row.table, row.row): case_of(study, row) for row in study.file.rows}
    for table in TABLES:
        for name in ("pmg", "particle-filter", "reference"):
            matched, everything, compensated = (
                cases[table, f"{name} {condition}"].scenario.estimator
                for condition in ("matched", "all", "all, delay compensated")
            )
            assert (matched.softness_mm, matched.radius_tolerance, matched.read_probability) == (1.0, 0.0, 0.98)
            assert everything.softness_mm == pytest.approx(math.sqrt(1 + 10**2 + 5**2))
            assert compensated.softness_mm == pytest.approx(math.sqrt(1 + 10**2))
            assert everything.radius_tolerance == pytest.approx(0.1)
            assert everything.read_probability == pytest.approx(0.95**2)
    for name in ("pmg", "particle-filter", "quantized-ekf"):
        for table, uses_rssi in (("navifloor", False), ("navifloor-rssi", True)):
            assert cases[table, f"{name} matched"].scenario.estimator.uses_rssi is uses_rssi
    # The world is the same with and without, and within a table the same for all filters.
    for condition in ("matched", "all"):
        worlds = {cases["navifloor", f"{name} {condition}"].scenario.world for name in loaded().file.grids[0].estimators
                  if ("navifloor", f"{name} {condition}") in cases}  # fmt: skip
        assert worlds == {cases["navifloor-rssi", f"pmg {condition}"].scenario.world}


@pytest.mark.slow
def test_every_row_has_its_numbers_and_every_claim_one():
    found, numbers = quick()
    assert all(math.isfinite(row.measured) for row in found.rows)
    assert all(claim.measured is not None for claim in found.claims)
    assert len(found.claims) >= 20
    assert all(numbers[row.table, row.row, "us_per_step"] > 0 for row in loaded().file.rows if row.table in TABLES)
    assert set(found.figures) == {"error-by-mismatch", "error-by-time"}


@pytest.mark.slow
def test_in_a_world_as_they_believe_it_filters_with_the_field_are_near_the_reference():
    _, numbers = quick()
    for table in TABLES:
        assert 0.9 < numbers[table, "reference / reference-40000 matched", "position_ratio"] < 1.1, table
        assert 0.7 < numbers[table, "pmg / reference matched", "position_ratio"] < 1.3, table
    for table in ("8x100", "8x16", "navifloor", "navifloor-rssi"):
        reference = numbers[table, "reference matched", "position_mean_mm"]
        for worse in ("mcl-gaussian", "quantized-ekf", "constrained-ekf"):
            assert numbers[table, f"{worse} matched", "position_mean_mm"] > 1.15 * reference, (table, worse)
    # What is off is paid for.
    for table in TABLES:
        for name in ("pmg", "particle-filter"):
            matched, everything = (numbers[table, f"{name} {c}", "position_mean_mm"] for c in ("matched", "all"))
            assert everything > 1.5 * matched, (table, name)
    assert numbers["8x100", "particle-filter us / pmg us matched", "us_ratio"] > 1.5
