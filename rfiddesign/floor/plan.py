"""The floor as polygons: where the robot's body can sweep and where its centre can be."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from rfiddesign.units import MM2_PER_M2

CORNER_SHARE = 0.22  # of the radius squared: a right-angled corner that a disc misses is 1 - pi/4 of it
MAX_EXTENT_MM = 5e6  # beyond 5 km a float32 millimetre is worse than 0.5 mm


@dataclass(frozen=True)
class Floor:
    """A floor that a robot drives on.

    Parameters
    ----------
    name : the floor's name in reports.
    drivable : what the robot's body can sweep: the area to be tagged [mm].
    navigable : where the robot's centre may be: `drivable` less the footprint [mm].
    source : where the plan comes from, for reports.

    Raises
    ------
    ValueError
        If either geometry is not a valid, non-empty polygon within 5 km of the frame's origin.
    """

    name: str
    drivable: BaseGeometry
    navigable: BaseGeometry
    source: str

    def __post_init__(self) -> None:
        for argument in ("drivable", "navigable"):
            _check_polygonal(argument, getattr(self, argument))

    @property
    def area_m2(self) -> float:
        """Area that the robot's body can sweep [m2]."""
        return self.drivable.area / MM2_PER_M2

    @property
    def navigable_m2(self) -> float:
        """Area that the robot's centre can reach [m2]."""
        return self.navigable.area / MM2_PER_M2

    @cached_property
    def refuge_mm(self) -> tuple[float, float]:
        """Some point inside `navigable` [mm]."""
        point = self.navigable.representative_point()
        return (point.x, point.y)

    @cached_property
    def navigable_bounds(self) -> tuple[float, float, float, float]:
        """Bounds of `navigable`: low x, low y, high x, high y [mm]."""
        return tuple(float(bound) for bound in self.navigable.bounds)

    @cached_property
    def navigable_edges(self) -> np.ndarray:
        """Edges of `navigable` as rows x0, y0, x1, y1 [mm], shape (n_edges, 4); built at the first use."""
        edges = []
        for ring in _rings(self.navigable):
            points = shapely.get_coordinates(ring)
            edges.append(np.column_stack([points[:-1], points[1:]]))
        return np.concatenate(edges)


def rectangle_floor(length_mm: float, width_mm: float, footprint_radius_mm: float, name: str = "rectangle") -> Floor:
    """Build an empty rectangular floor with its lower left corner at the origin, the length along x.

    Raises
    ------
    ValueError
        If a side is not positive, or the robot does not fit.
    """
    for argument, value in (("length_mm", length_mm), ("width_mm", width_mm)):
        if not 0.0 < value <= MAX_EXTENT_MM:
            raise ValueError(f"{argument} is {value:g}; allowed is more than 0 up to {MAX_EXTENT_MM:g} mm")
    outline = shapely.box(0.0, 0.0, length_mm, width_mm)
    return floor_from_polygon(outline, (), footprint_radius_mm, name=name, source=f"{length_mm:g} x {width_mm:g} mm")


def floor_from_polygon(
    drivable_outline: BaseGeometry | Sequence,
    keep_outs: Sequence,
    footprint_radius_mm: float,
    *,
    name: str = "polygon",
    source: str = "polygon",
) -> Floor:
    """Build a floor from a drawn outline and keep-outs; parts that the robot cannot reach are left out.

    Corners that a round robot passes without sweeping them count as drivable, unlike on a map: there the covering is
    laid too.

    Parameters
    ----------
    drivable_outline : polygon or sequence of (x, y) [mm].
    keep_outs : polygons or sequences of (x, y) [mm] that are cut out.
    footprint_radius_mm : radius of the robot's footprint about its centre; arcs are exact to 0.13 % of it.

    Raises
    ------
    ValueError
        If an outline is not a valid polygon, the radius is not positive, or the robot does not fit anywhere.
    """
    check_footprint(footprint_radius_mm)
    outline = _as_polygon("drivable_outline", drivable_outline)
    blocked = [_as_polygon(f"keep_outs[{i}]", keep_out) for i, keep_out in enumerate(keep_outs)]
    open_floor = outline.difference(shapely.union_all(blocked)) if blocked else outline
    navigable = largest_part(open_floor.buffer(-footprint_radius_mm, quad_segs=16))
    if navigable.is_empty:
        raise ValueError(f"footprint_radius_mm is {footprint_radius_mm:g}: the robot does not fit on the floor")
    swept = navigable.buffer(footprint_radius_mm, quad_segs=16).intersection(open_floor)
    missed = shapely.get_parts(open_floor.difference(swept))
    corners = missed[shapely.area(missed) <= CORNER_SHARE * footprint_radius_mm**2]
    return Floor(name, largest_part(shapely.union_all([swept, *corners])), navigable, source)


def check_footprint(footprint_radius_mm: float) -> None:
    """Raise ValueError unless the radius is positive and below 100 m."""
    if not 0.0 < footprint_radius_mm <= 1e5:
        raise ValueError(f"footprint_radius_mm is {footprint_radius_mm:g}; allowed is more than 0 up to 100000 mm")


def largest_part(geometry: BaseGeometry) -> Polygon:
    """Return the polygon of largest area in a geometry, the empty polygon if it has none."""
    parts = [part for part in shapely.get_parts(geometry) if isinstance(part, Polygon)]
    return max(parts, key=lambda part: part.area, default=Polygon())


def _as_polygon(argument: str, outline: BaseGeometry | Sequence) -> BaseGeometry:
    if not isinstance(outline, BaseGeometry):
        points = np.asarray(outline, dtype=float)
        if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3:
            raise ValueError(f"{argument} has shape {points.shape}; allowed are at least three (x, y)")
        outline = Polygon(points)
    _check_polygonal(argument, outline)
    return outline


def _check_polygonal(argument: str, geometry: BaseGeometry) -> None:
    if not isinstance(geometry, (Polygon, MultiPolygon)):
        raise ValueError(f"{argument} is a {type(geometry).__name__}; allowed is a polygon")
    if geometry.is_empty or not geometry.is_valid:
        reason = "empty" if geometry.is_empty else shapely.is_valid_reason(geometry)
        raise ValueError(f"{argument} is {reason}; allowed is a valid polygon with an area")
    extent = np.abs(geometry.bounds).max()
    if extent > MAX_EXTENT_MM:
        raise ValueError(f"{argument} reaches {extent:g} mm from the origin; allowed are {MAX_EXTENT_MM:g} mm")


def _rings(geometry: BaseGeometry) -> list:
    rings = []
    for polygon in shapely.get_parts(geometry):
        rings += [polygon.exterior, *polygon.interiors]
    return rings
