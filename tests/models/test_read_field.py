"""What the compiled run takes for a detection area is that area."""

import numpy as np
import pytest
from numba import njit

from rfiddesign.geometry import Disc, Ellipse, PolygonArea, ProbabilityMap, Rectangle, Ring, RoundedRectangle
from rfiddesign.models.read_field import read_field
from rfiddesign.simulation._poll_kernels import read_chance

RNG = np.random.Generator(np.random.PCG64(3))
EXACT = [Disc(30.0), Disc(9.0), Rectangle(320.0, 230.0), Rectangle(20.0, 90.0), RoundedRectangle(80.0, 60.0, 12.0)]
TABULATED = [
    Ellipse(120.0, 40.0),
    Ring(20.0, 70.0),
    PolygonArea(((-30.0, -20.0), (70.0, -10.0), (10.0, 50.0))),
    Ellipse(2000.0, 900.0),
]


@njit
def chances(points, field):
    out = np.empty(points.shape[0])
    box = (field.half_length_mm, field.half_width_mm, field.corner_mm, field.reach_mm, field.cell_mm)
    for i in range(points.shape[0]):
        out[i] = read_chance(points[i, 0], points[i, 1], box, field.table)
    return out


def points_about(area, n=100_000):
    return RNG.uniform(-1.2, 1.2, (n, 2)) * area.reach_mm


@pytest.mark.parametrize("area", EXACT, ids=repr)
def test_discs_and_rectangles_are_exact(area):
    points = points_about(area)
    points = points[np.abs(area.signed_distance(points)) > 1e-9]
    assert np.array_equal(chances(points, read_field(area)) > 0, area.contains(points))


@pytest.mark.parametrize("area", TABULATED, ids=repr)
def test_other_areas_are_exact_but_for_a_cell_along_their_border(area):
    points, field = points_about(area), read_field(area)
    chance = chances(points, field)
    assert set(np.unique(chance)) == {0.0, 1.0}
    differs = (chance > 0) != area.contains(points)
    assert np.abs(area.signed_distance(points[differs])).max() <= field.cell_mm * np.sqrt(0.5) + 1e-6
    # The border's cells even out: the share of points in view is that of the area.
    assert chance.mean() * (2.4 * area.reach_mm) ** 2 == pytest.approx(area.area_mm2, rel=0.03)


@pytest.mark.parametrize("area", EXACT + TABULATED, ids=repr)
def test_no_tag_is_in_view_beyond_the_reach(area):
    field = read_field(area)
    direction = RNG.uniform(0, 2 * np.pi, 20_000)
    distance = field.reach_mm * RNG.uniform(1.000001, 1.5, 20_000)
    points = np.stack([distance * np.cos(direction), distance * np.sin(direction)], axis=-1)
    assert not chances(points, field).any()


def test_a_large_area_stays_a_small_table():
    assert read_field(TABULATED[-1]).table.nbytes <= 4 * 1026**2


def test_a_probability_map_is_looked_up_to_the_letter():
    probability = RNG.random((7, 12))
    area = ProbabilityMap(probability, 10.0)
    points = RNG.uniform(-80, 80, (50_000, 2))
    assert np.array_equal(
        chances(points, read_field(area)).astype(np.float32), area.probability_at(points).astype(np.float32)
    )
