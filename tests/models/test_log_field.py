"""Logarithms of read chances about an antenna: relative to far away, and no larger than they need be."""

import math

import numpy as np
import pytest

from rfiddesign.geometry import Disc, PolygonArea
from rfiddesign.models.log_field import log_field, log_field_of
from rfiddesign.models.soft_field import read_tables

AREA = PolygonArea(((-30.0, -20.0), (70.0, -10.0), (10.0, 50.0)))


def entry_at(field, table, place):
    j = (place[0] - field.low_u) / field.cell_mm
    k = (place[1] - field.low_v) / field.cell_mm
    assert j == pytest.approx(round(j), abs=1e-6)
    return float(field.tables[table, round(j), round(k)] + field.far[table])


@pytest.mark.parametrize(("area", "radii"), [(AREA, ()), (Disc(105.0), (105.0, 90.0, 60.0))])
def test_a_field_of_an_area_says_what_its_tables_say(area, radii):
    tables, cell, _ = read_tables(area, radii, 6.0, 0.9)
    field = log_field(area, 6.0, 0.9, radii)
    n_u, n_v = tables.shape[1:]
    rng = np.random.default_rng(1)
    for _ in range(50):
        j, k = rng.integers(n_u // 4, 3 * n_u // 4), rng.integers(n_v // 4, 3 * n_v // 4)
        place = ((j - (n_u - 1) / 2) * cell, (k - (n_v - 1) / 2) * cell)
        for table in range(len(tables)):
            assert entry_at(field, table, place) == pytest.approx(tables[table, j, k], abs=1e-5)


@pytest.mark.parametrize("field", [log_field(AREA, 6.0, 0.9), log_field_of(np.full((4, 3), 0.5), 10.0, (100.0, -10.0))])
def test_the_outermost_entries_say_nothing_and_those_within_do(field):
    says = (field.tables != 0).any(axis=0)
    assert not says[[0, -1]].any()
    assert not says[:, [0, -1]].any()
    assert says[1].any()
    assert says[-2].any()
    assert says[:, 1].any()
    assert says[:, -2].any()
    assert field.far[-1] == 0.0


def test_chances_of_one_power_are_read_and_not_read():
    field = log_field_of([[0.25]], 10.0, (50.0, -20.0))
    assert field.tables.shape == (2, 3, 3)
    assert entry_at(field, 0, (50.0, -20.0)) == pytest.approx(math.log(0.25))
    assert entry_at(field, 1, (50.0, -20.0)) == pytest.approx(math.log(0.75))
    assert entry_at(field, 0, (60.0, -20.0)) == pytest.approx(math.log(1e-3))
    assert field.reach_mm == pytest.approx(math.hypot(60.0, 30.0))


def test_powers_are_tried_one_after_the_other():
    field = log_field_of([[[0.2]], [[0.5]]], 10.0, (0.0, 0.0))
    told = [math.exp(entry_at(field, table, (0.0, 0.0))) for table in range(4)]
    assert told == pytest.approx([0.6, 0.2, 0.4, 0.4])


def test_a_field_that_says_nothing_is_refused():
    with pytest.raises(ValueError, match="say something"):
        log_field_of(np.zeros((3, 3)), 10.0, (0.0, 0.0))
