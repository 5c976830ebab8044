"""What a poll says of a tag's place, in tables: the formula cell by cell, and a brute-force blur."""

import math

import numpy as np
import pytest
from scipy.signal import fftconvolve
from scipy.special import ndtr

from rfiddesign.geometry import Disc, Ellipse, PolygonArea, ProbabilityMap, Rectangle, Ring, RoundedRectangle
from rfiddesign.models.soft_field import LEAST_PROBABILITY, read_tables, soft_discs

AREAS = [
    Disc(30.0),
    Rectangle(120.0, 60.0),
    RoundedRectangle(80.0, 60.0, 10.0),
    Ellipse(60.0, 30.0),
    Ring(30.0, 70.0),
    PolygonArea(((-30.0, -20.0), (70.0, -10.0), (10.0, 50.0))),
]
RADII = (105.0, 90.0, 60.0, 40.0)
MEASURED = ProbabilityMap(np.array([[0.9, 0.1, 0.3, 0.0], [0.6, 1.0, 0.4, 1.0]]), 20.0)
every_area = pytest.mark.parametrize("area", AREAS, ids=lambda area: type(area).__name__)
every_softness = pytest.mark.parametrize("softness", [0.0, 0.5, 3.0, 12.0])


def centres(tables, cell):
    """Centres (n, m, 2) of the cells in the antenna's frame."""
    axes = [(np.arange(n) + 0.5 - n / 2) * cell for n in tables.shape[1:]]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def log_seen(field, p):
    return np.log(np.maximum(p * field, LEAST_PROBABILITY))


def largest(difference):
    return np.abs(difference).max()


def soft(depth, softness):
    return ndtr(depth / softness) if softness > 0 else (depth >= 0).astype(float)


@every_softness
@every_area
def test_a_read_and_no_read_are_tabulated_by_their_formulas(area, softness):
    """p Phi(depth / softness) and 1 - p Phi(depth / softness) at each cell's centre."""
    p = 0.9
    tables, cell, _ = read_tables(area, (), softness, p)
    assert tables.dtype == np.float32
    field = soft(-area.signed_distance(centres(tables, cell)), softness)
    assert len(tables) == 2
    assert largest(tables[0] - log_seen(field, p)) < 2e-6
    assert largest(tables[1][1:-1, 1:-1] - np.log1p(-p * field)[1:-1, 1:-1]) < 2e-6


@every_softness
def test_a_read_with_rssi_is_in_its_ring(softness):
    p = 0.98
    tables, cell, _ = read_tables(Disc(RADII[0]), RADII, softness, p)
    assert len(tables) == len(RADII) + 2
    distance = np.hypot(*np.moveaxis(centres(tables, cell), -1, 0))
    discs = [soft(radius - distance, softness) for radius in RADII] + [np.zeros_like(distance)]
    for j in range(len(RADII)):
        assert largest(tables[j + 1] - log_seen(discs[j] - discs[j + 1], p)) < 1e-5
    # Some step is read if any is.
    rings = np.exp(tables[1:-1].astype(float))
    rings[rings < 1.01 * LEAST_PROBABILITY] = 0.0
    assert largest(rings.sum(axis=0) - np.exp(tables[0])) < 5 * LEAST_PROBABILITY


@pytest.mark.parametrize("area", [Disc(30.0), Rectangle(120.0, 60.0)], ids=repr)
def test_the_soft_border_is_that_of_a_blurred_area(area):
    """Brute force: the area in cells of 0.25 mm, convolved with a Gaussian; bends of its border cost little."""
    softness, fine = 3.0, 0.25
    tables, cell, _ = read_tables(area, (), softness, 0.999)
    place = centres(tables, cell)
    half = np.ceil(np.abs(place).max(axis=(0, 1))) + 12
    axes = [np.arange(-h, h + fine / 2, fine) for h in half]
    sharp = area.contains(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)).astype(float)
    g = np.exp(-(np.arange(-15, 15 + fine / 2, fine) ** 2) / (2 * softness**2))
    blurred = fftconvolve(sharp, np.outer(g, g) / g.sum() ** 2, mode="same")
    nearest = [np.rint((place[..., k] + half[k]) / fine).astype(int) for k in (0, 1)]
    difference = np.exp(tables[0]) / 0.999 - blurred[nearest[0], nearest[1]]
    u, v = np.abs(place[..., 0]), np.abs(place[..., 1])
    is_corner = (np.hypot(u - 60, v - 30) < 10) if isinstance(area, Rectangle) else np.zeros(u.shape, bool)
    assert np.abs(difference[~is_corner]).max() < 0.03
    assert np.abs(difference).max() < 0.3


@pytest.mark.parametrize("softness", [0.0, 5.0, 25.0])
def test_a_measured_map_is_blurred_cell_by_cell(softness):
    """Brute force: each cell spreads its probability by a Gaussian over the cells about it."""
    p = 0.95
    tables, cell, _ = read_tables(MEASURED, (), softness, p)
    assert cell == MEASURED.cell_mm
    place, blurred = centres(tables, cell), np.zeros(tables.shape[1:])
    offsets = np.arange(-int(4 * softness / cell + 0.5), int(4 * softness / cell + 0.5) + 1)
    g = np.exp(-((offsets * cell) ** 2) / (2 * softness**2)) if softness > 0 else np.ones(1)
    for i, wi in zip(offsets, g / g.sum(), strict=True):
        for j, wj in zip(offsets, g / g.sum(), strict=True):
            blurred += wi * wj * MEASURED.probability_at(place + np.array([i, j]) * cell)
    assert largest(tables[0] - log_seen(blurred, p)) < 1e-5
    assert largest(tables[1][1:-1, 1:-1] - np.log1p(-p * blurred)[1:-1, 1:-1]) < 1e-5


@every_softness
@pytest.mark.parametrize("area", [*AREAS, MEASURED, Disc(2000.0)], ids=lambda area: type(area).__name__)
def test_the_border_holds_the_value_of_far_away(area, softness):
    """A read is as unlikely as can be, no read says nothing, to the last bit."""
    radii = (area.radius_mm, area.radius_mm / 2) if isinstance(area, Disc) else ()
    tables, _, _ = read_tables(area, radii, softness, 0.98)
    for table in tables[:-1]:
        for border in (table[0], table[-1], table[:, 0], table[:, -1]):
            assert (border == np.float32(math.log(LEAST_PROBABILITY))).all()
    for border in (tables[-1][0], tables[-1][-1], tables[-1][:, 0], tables[-1][:, -1]):
        assert (border == 0.0).all()


@every_softness
@pytest.mark.parametrize("area", [*AREAS, MEASURED, Disc(2000.0)], ids=lambda area: type(area).__name__)
def test_beyond_the_reach_a_tag_is_read_with_a_chance_below_a_hundredth(area, softness):
    """So that it says next to nothing if it is not."""
    tables, cell, reach = read_tables(area, (), softness, 0.98)
    distance = np.hypot(*np.moveaxis(centres(tables, cell), -1, 0))
    assert -np.expm1(tables[-1][distance > reach]).min(initial=0.0) < 0.0105
    # And within it is all of the area.
    assert reach >= area.reach_mm


def test_a_large_area_has_coarser_cells():
    tables, cell, _ = read_tables(Disc(2000.0), (), 3.0, 0.98)
    assert max(tables.shape) <= 514
    assert cell > 7.0
    assert read_tables(Disc(30.0), (), 3.0, 0.98)[1] == 1.0


def test_nothing_is_certain():
    """However sharp the field and sure the reader, no table says never."""
    for area in AREAS:
        tables, _, _ = read_tables(area, (), 0.0, 0.999)
        assert np.isfinite(tables).all()
        assert (tables <= 0).all()


# Discs, which need no table


def step(depth, per_width):
    """Chance to be inside a border that is blurred by a cubic."""
    t = np.clip(depth * per_width + 0.5, 0.0, 1.0)
    return t * t * (3 - 2 * t)


def told(thing, distance, per_width):
    """Probability of what a poll says, by its row of `soft_discs`."""
    outer, inner, a, b = thing[:, 0].astype(float)
    return a + b * (step(outer - distance, per_width) - step(inner - distance, per_width))


@every_softness
@pytest.mark.parametrize("radii", [(), RADII[:1], RADII], ids=len)
def test_discs_say_what_their_tables_do_but_for_the_shape_of_the_border(radii, softness):
    """A cubic of the Gaussian's variance lies within 0.03 of it; rings have two borders."""
    p = 0.9
    things, per_width, _ = soft_discs(RADII[0], radii, softness, p)
    tables, cell, _ = read_tables(Disc(RADII[0]), radii, softness, p)
    assert things.shape == (len(tables), 4, 1)
    distance = np.hypot(*np.moveaxis(centres(tables, cell), -1, 0))
    # A sharp border leaves no room for rounding.
    is_clear = np.abs(distance[..., None] - RADII).min(axis=-1) > 0.02
    for thing, table in zip(things, np.exp(tables), strict=True):
        expected = np.maximum(told(thing, distance, per_width), LEAST_PROBABILITY)
        assert largest((expected - table)[is_clear]) < 0.06
        if softness == 0:
            assert largest((expected - table)[is_clear]) < 1e-6


@every_softness
def test_far_away_a_disc_is_not_read_and_its_rings_are_all_of_it(softness):
    things, per_width, reach = soft_discs(RADII[0], RADII, softness, 0.95)
    distance = np.linspace(0, 2 * reach, 2000)
    read, *rings, unread = (told(thing, distance, per_width) for thing in things)
    assert largest(np.sum(rings, axis=0) - read) < 1e-6
    assert largest(read + unread - 1.0) < 1e-6
    assert (read[distance > reach] == 0).all()
    assert (unread[distance > reach] == 1).all()
    assert read.max() == pytest.approx(0.95)


def test_the_border_of_a_disc_has_the_spread_that_was_asked_for():
    _, per_width, _ = soft_discs(100.0, (), 7.0, 0.95)
    depth = np.linspace(-60, 60, 24_001)
    density = np.gradient(step(depth, per_width), depth)
    assert math.sqrt(np.average(depth**2, weights=density)) == pytest.approx(7.0, rel=1e-3)
