"""The chance of a read along a path against a brute force, and the bounds of eqs. 3 and 4."""

import math

import numpy as np
import pytest
import shapely

from rfiddesign.reproduce import load_reproduction
from rfiddesign.reproduce.analyses.smart_floor import (
    PATHS_MM,
    PITCH_MM,
    RADIUS_MM,
    bounds_of_equations_3_and_4,
    patterns,
    read_chances,
)
from rfiddesign.reproduce.context import Context


def rng_of(seed):
    return np.random.Generator(np.random.PCG64(seed))


@pytest.mark.parametrize("name", list(patterns()))
def test_chances_are_those_of_paths_measured_one_by_one(name):
    """The same paths as lines, and the distance of each to the nearest of many tags (GEOS)."""
    pattern, n = patterns()[name], 400
    chances = read_chances(pattern, n, rng_of(5))
    rng = rng_of(5)
    starts = pattern.lattice.at(rng.random((n, 2)))
    angles = 2 * math.pi * rng.random(n)
    indices = np.stack(np.meshgrid(np.arange(-12, 13), np.arange(-12, 13)), axis=-1).reshape(-1, 2)
    tags = shapely.MultiPoint(pattern.lattice.at(indices))
    for length, chance in zip(PATHS_MM, chances, strict=True):
        ends = starts + length * np.column_stack([np.cos(angles), np.sin(angles)])
        distances = shapely.distance(shapely.linestrings(np.stack([starts, ends], axis=1)), tags)
        assert chance == (distances < RADIUS_MM).mean()
    assert chances == sorted(chances)


def test_a_point_reads_with_the_share_of_the_floor_that_discs_cover_and_a_path_adds_its_swath():
    """A path of length l meets no more than the tags in 2 R l + pi R^2 around it: a bound on the chance."""
    for pattern in patterns().values():
        density = 1.0 / pattern.lattice.cell_area_mm2
        for length, chance in zip(PATHS_MM, read_chances(pattern, 5000, rng_of(6)), strict=True):
            expected = density * (2 * RADIUS_MM * length + math.pi * RADIUS_MM**2)
            assert chance <= min(1.0, expected) + 4 / math.sqrt(5000)
    # The shortest path is shorter than the pitch less two radii: it meets one tag at most, and the bound is reached.
    assert PATHS_MM[0] < PITCH_MM - 2 * RADIUS_MM
    square = read_chances(patterns()["square"], 40_000, rng_of(7))[0]
    expected = (2 * RADIUS_MM * PATHS_MM[0] + math.pi * RADIUS_MM**2) / PITCH_MM**2
    assert square == pytest.approx(expected, abs=4 * math.sqrt(expected * (1 - expected) / 40_000))


def test_triangles_are_as_wide_or_as_dense_as_the_square():
    square, as_wide, as_dense = patterns().values()
    assert as_wide.lattice.min_distance_mm == pytest.approx(square.lattice.min_distance_mm) == PITCH_MM
    assert as_dense.tags_per_m2 == pytest.approx(square.tags_per_m2)
    assert as_wide.tags_per_m2 == pytest.approx(square.tags_per_m2 * 2 / math.sqrt(3))


def test_the_first_read_keeps_the_bounds_of_eqs_3_and_4():
    context = Context(load_reproduction("markov-smart-floor"), True, 1, (), {}, lambda *_: None)
    rows = {row.row: row for row in bounds_of_equations_3_and_4(context)}
    assert {row.table for row in rows.values()} == {"eqs. 3 and 4"}
    assert rows["first read within eq. 3"].measured == 1.0
    assert rows["first read within eq. 4"].measured == 1.0
    assert RADIUS_MM - 5.0 < rows["ahead, largest"].measured <= RADIUS_MM
    assert rows["ahead, largest"].unit == "mm"
    assert rows["across over its bound, largest"].measured <= 1.0 + 1e-9
    # A disc entered anywhere across: sqrt(R^2 - across^2) ahead, pi/4 radii in the mean, less half a poll's way.
    ahead = rows["ahead, mean over radius"]
    assert ahead.measured == pytest.approx(math.pi / 4 - 0.5 / RADIUS_MM, abs=4 * ahead.stderr)
