"""Outlines keep the cells' area and shape."""

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import ndimage

from rfiddesign.floor.outlines import outline_cells


def staircase(is_inside):
    """The plain union of the cells' squares: the twin."""
    rows, columns = np.nonzero(is_inside)
    bottom = is_inside.shape[0] - 1 - rows
    return shapely.union_all(shapely.box(columns, bottom, columns + 1, bottom + 1))


def test_a_rectangle_keeps_its_place_with_the_top_row_at_the_top():
    is_inside = np.zeros((50, 80), dtype=bool)
    is_inside[:10, 20:70] = True
    outline = outline_cells(is_inside)
    assert outline.bounds == (20.0, 40.0, 70.0, 50.0)
    assert outline.area == pytest.approx(500.0, rel=0.005)


def test_a_diagonal_wall_becomes_a_straight_line():
    rows, columns = np.mgrid[:60, :60]
    outline = outline_cells(rows + columns < 60)
    assert shapely.get_num_coordinates(outline) < 12
    assert outline.area == pytest.approx(60 * 61 / 2, rel=0.005)


def test_a_hole_stays_a_hole():
    is_inside = np.ones((60, 60), dtype=bool)
    is_inside[20:30, 20:40] = False
    outline = outline_cells(is_inside)
    assert len(outline.interiors) == 1
    assert shapely.Polygon(outline.interiors[0]).area == pytest.approx(200.0, rel=0.01)


def test_no_cell_has_no_outline():
    assert outline_cells(np.zeros((5, 5), dtype=bool)).is_empty


@settings(max_examples=200, deadline=None)
@given(is_inside=hnp.arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12))))
def test_any_grid_has_a_valid_outline_near_its_cells(is_inside):
    assume(is_inside.any())
    cells, outline = staircase(is_inside), outline_cells(is_inside)
    assert outline.is_valid
    assert abs(outline.area - cells.area) <= 0.005 * cells.area + 1e-9
    # a bevel of 0.36 pixels and at most half a pixel of simplification
    assert cells.buffer(0.87).covers(outline)
    assert outline.buffer(0.87).covers(cells)


def test_a_large_noisy_blob_is_evened_out():
    noise = np.random.Generator(np.random.PCG64(5)).standard_normal((200, 200))
    is_inside = ndimage.gaussian_filter(noise, 4.0) > 0.0
    cells, outline = staircase(is_inside), outline_cells(is_inside)
    assert outline.area == pytest.approx(cells.area, rel=0.005)
    assert shapely.get_num_coordinates(outline) < 0.6 * shapely.get_num_coordinates(cells.simplify(0.0))
    assert shapely.hausdorff_distance(cells.boundary, outline.boundary) < 1.0
