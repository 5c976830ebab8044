"""Outlines of a grid's cells as polygons."""

import numpy as np
import shapely
from shapely.geometry import LinearRing, Polygon

MAX_TOLERANCE_PIXELS = 0.5
MAX_AREA_CHANGE = 0.005


def outline_cells(is_inside: np.ndarray) -> shapely.geometry.base.BaseGeometry:
    """Outline the cells of a grid, staircases evened out.

    Each corner of the staircase is bevelled from half a pixel before it to half a pixel behind it (so that a diagonal
    wall becomes a straight line; this cuts 0.35 pixels off a corner), then the outline is simplified by at most half a
    pixel. Its area moves by at most 0.5 %.

    Parameters
    ----------
    is_inside : shape (n_rows, n_columns), bool; row 0 is the top row of the image.

    Returns
    -------
    Polygon or MultiPolygon in pixels, x to the right, y upwards, the lower left corner of the grid at (0, 0); empty if
    no cell is inside.
    """
    cells = shapely.union_all(_row_runs(is_inside)).simplify(0.0)  # tolerance 0 drops the vertices on straight edges
    bevelled = shapely.union_all([_bevel(polygon) for polygon in shapely.get_parts(cells)])
    tolerance = MAX_TOLERANCE_PIXELS
    outline = bevelled.simplify(tolerance)
    while abs(outline.area - cells.area) > MAX_AREA_CHANGE * cells.area and tolerance > 1e-3:
        tolerance /= 2.0
        outline = bevelled.simplify(tolerance)
    is_kept = outline.is_valid and abs(outline.area - cells.area) <= MAX_AREA_CHANGE * cells.area
    return outline if is_kept else cells  # a few lone cells lose more than 0.5 % by their corners


def _row_runs(is_inside: np.ndarray) -> np.ndarray:
    """Rectangles of the runs of inside cells in each row, in pixels."""
    padded = np.pad(is_inside.astype(np.int8), ((0, 0), (1, 1)))
    rows, edges = np.nonzero(np.diff(padded, axis=1))
    top = is_inside.shape[0] - rows[::2]
    return shapely.box(edges[::2], top - 1, edges[1::2], top)


def _bevel(polygon: Polygon) -> shapely.geometry.base.BaseGeometry:
    exterior = _bevel_ring(polygon.exterior)
    bevelled = Polygon(exterior, [_bevel_ring(ring) for ring in polygon.interiors])
    return bevelled if bevelled.is_valid else bevelled.buffer(0.0)


def _bevel_ring(ring: LinearRing) -> np.ndarray:
    """Replace each corner of an axis-parallel ring by the points half a pixel before and behind it."""
    corners = shapely.get_coordinates(ring)
    direction = np.sign(np.diff(corners, axis=0))
    points = np.stack([corners[:-1] + 0.5 * direction, corners[1:] - 0.5 * direction], axis=1)
    return points.reshape(-1, 2)
