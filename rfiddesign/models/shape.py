"""A detection area as a constraint: the form in which compiled filters measure the distance to its border."""

import math
from typing import NamedTuple

import numpy as np
import shapely

from rfiddesign.geometry import DetectionArea, Disc, Rectangle, RoundedRectangle

# The drawn outline of any other area is thinned by at most this: less than anything a filter can tell.
_TOLERANCE_MM = 0.05


class Shape(NamedTuple):
    """What lies within `corner_mm` of a box of the given half sides, or is enclosed by segments.

    Fields: half_length_mm, half_width_mm, corner_mm (float); segments (n, 4) u0, v0, u1, v1 of the border [mm], none
    for a rounded rectangle; mean (2,) [mm] and covariance (2, 2) [mm^2] of a tag anywhere in the area; rssi_radii (m,)
    radius of each step of RSSI [mm].
    """

    half_length_mm: float
    half_width_mm: float
    corner_mm: float
    segments: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray
    rssi_radii: np.ndarray


def radius_of(area: DetectionArea) -> float:
    """Radius [mm] of a disc, or of the disc in which a tag is as uncertain as in the area."""
    return math.sqrt(2.0 * float(np.trace(np.asarray(area.covariance_mm2))))


def shape_of(area: DetectionArea, rssi_radii_mm: tuple[float, ...] = ()) -> Shape:
    """The shape of an area: exact for disc, rectangle, rounded rectangle and polygon, its outline for any other."""
    moments = (np.array(area.centroid_mm, float), np.array(area.covariance_mm2, float), np.array(rssi_radii_mm, float))
    none = np.empty((0, 4))
    if isinstance(area, Disc):
        return Shape(0.0, 0.0, float(area.radius_mm), none, *moments)
    if isinstance(area, Rectangle):
        return Shape(area.length_mm / 2, area.width_mm / 2, 0.0, none, *moments)
    if isinstance(area, RoundedRectangle):
        corner = float(area.corner_mm)
        return Shape(area.length_mm / 2 - corner, area.width_mm / 2 - corner, corner, none, *moments)
    border = area.outline().simplify(_TOLERANCE_MM).boundary
    rings = [shapely.get_coordinates(line) for line in shapely.get_parts(border)]
    segments = np.concatenate([np.hstack([ring[:-1], ring[1:]]) for ring in rings])
    return Shape(0.0, 0.0, 0.0, np.ascontiguousarray(segments), *moments)
