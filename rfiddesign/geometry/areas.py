"""Detection areas: the region of the floor, around an antenna, within which that antenna reads a tag.

Every area lives in its antenna's frame (origin at the antenna's centre, x along its length) and is the set where the
read probability exceeds 1/2. All of them offer the same few properties, see `DetectionArea`.
"""

import math
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign import require

#: Corners per quarter turn of a drawn circle: the chords stay within 8e-5 radii of it, its area within 1e-4.
QUARTER_SEGMENTS = 64


@runtime_checkable
class DetectionArea(Protocol):
    """What every detection area offers, in its antenna's frame [mm]."""

    @property
    def area_mm2(self) -> float:
        """Area [mm^2]."""
        ...

    @property
    def reach_mm(self) -> float:
        """Largest distance [mm] of a point of the area from the antenna's centre."""
        ...

    @property
    def centroid_mm(self) -> NDArray[np.float64]:
        """Mean position (2,) [mm] of a tag that is equally likely anywhere in the area."""
        ...

    @property
    def covariance_mm2(self) -> NDArray[np.float64]:
        """Covariance (2, 2) [mm^2] of that position about `centroid_mm`."""
        ...

    def outline(self) -> BaseGeometry:
        """Return the area as a shapely geometry, its circles as polygons, see `QUARTER_SEGMENTS`."""
        ...

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Tell for points (..., 2) [mm] whether they lie in the area or on its border."""
        ...

    def signed_distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the distance [mm] of points (..., 2) [mm] to the area's border, negative inside."""
        ...


@dataclass(frozen=True)
class Disc:
    """A disc of `radius_mm` about the antenna's centre."""

    radius_mm: float

    def __post_init__(self):
        require.positive("radius_mm", self.radius_mm)

    @property
    def area_mm2(self) -> float:
        return math.pi * self.radius_mm**2

    @property
    def reach_mm(self) -> float:
        return float(self.radius_mm)

    @property
    def centroid_mm(self) -> NDArray[np.float64]:
        return np.zeros(2)

    @property
    def covariance_mm2(self) -> NDArray[np.float64]:
        return np.eye(2) * self.radius_mm**2 / 4

    def outline(self) -> shapely.Polygon:
        return shapely.Point(0, 0).buffer(self.radius_mm, quad_segs=QUARTER_SEGMENTS)

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        return self.signed_distance(points) <= 0

    def signed_distance(self, points: ArrayLike) -> NDArray[np.float64]:
        x, y = _coordinates(points)
        return np.hypot(x, y) - self.radius_mm


@dataclass(frozen=True)
class RoundedRectangle:
    """A rectangle, `length_mm` along x and `width_mm` along y, whose corners are arcs of radius `corner_mm`."""

    length_mm: float
    width_mm: float
    corner_mm: float

    def __post_init__(self):
        length = require.positive("length_mm", self.length_mm)
        width = require.positive("width_mm", self.width_mm)
        corner = require.not_negative("corner_mm", self.corner_mm)
        if corner > min(length, width) / 2:
            raise ValueError(
                f"corner_mm = {corner:g}: must be at most {min(length, width) / 2:g}, half the shorter side"
            )

    @property
    def area_mm2(self) -> float:
        return self.length_mm * self.width_mm - (4 - math.pi) * self.corner_mm**2

    @property
    def reach_mm(self) -> float:
        corner = self.corner_mm
        return math.hypot(self.length_mm / 2 - corner, self.width_mm / 2 - corner) + corner

    @property
    def centroid_mm(self) -> NDArray[np.float64]:
        return np.zeros(2)

    @property
    def covariance_mm2(self) -> NDArray[np.float64]:
        moments = [
            _second_moment(along, across, self.corner_mm)
            for along, across in ((self.length_mm, self.width_mm), (self.width_mm, self.length_mm))
        ]
        return np.diag(moments) / self.area_mm2

    def outline(self) -> shapely.Polygon:
        corner = self.corner_mm
        half_x, half_y = self.length_mm / 2, self.width_mm / 2
        if corner == 0:
            return shapely.box(-half_x, -half_y, half_x, half_y)
        quarter = np.linspace(0, math.pi / 2, QUARTER_SEGMENTS + 1)
        arc = np.stack(
            [half_x - corner + corner * np.cos(quarter), half_y - corner + corner * np.sin(quarter)], axis=-1
        )
        # Mirrored arcs run backwards, so that the four together go once around.
        mirrored = (arc, arc[::-1] * (-1, 1), -arc, arc[::-1] * (1, -1))
        return shapely.Polygon(np.concatenate(mirrored))

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        return self.signed_distance(points) <= 0

    def signed_distance(self, points: ArrayLike) -> NDArray[np.float64]:
        x, y = _coordinates(points)
        beyond_x = np.abs(x) - (self.length_mm / 2 - self.corner_mm)
        beyond_y = np.abs(y) - (self.width_mm / 2 - self.corner_mm)
        outside = np.hypot(np.maximum(beyond_x, 0), np.maximum(beyond_y, 0))
        return outside + np.minimum(np.maximum(beyond_x, beyond_y), 0) - self.corner_mm


@dataclass(frozen=True)
class Rectangle:
    """A rectangle about the antenna's centre, `length_mm` along x and `width_mm` along y."""

    length_mm: float
    width_mm: float

    def __post_init__(self):
        require.positive("length_mm", self.length_mm)
        require.positive("width_mm", self.width_mm)

    @property
    def _rounded(self) -> RoundedRectangle:
        return RoundedRectangle(self.length_mm, self.width_mm, 0.0)

    @property
    def area_mm2(self) -> float:
        return float(self.length_mm * self.width_mm)

    @property
    def reach_mm(self) -> float:
        return self._rounded.reach_mm

    @property
    def centroid_mm(self) -> NDArray[np.float64]:
        return np.zeros(2)

    @property
    def covariance_mm2(self) -> NDArray[np.float64]:
        return np.diag([self.length_mm**2, self.width_mm**2]) / 12

    def outline(self) -> shapely.Polygon:
        return self._rounded.outline()

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        return self.signed_distance(points) <= 0

    def signed_distance(self, points: ArrayLike) -> NDArray[np.float64]:
        return self._rounded.signed_distance(points)


@dataclass(frozen=True)
class Ring:
    """The ring between two circles about the antenna's centre, of radius `inner_mm` and `outer_mm`."""

    inner_mm: float
    outer_mm: float

    def __post_init__(self):
        inner = require.positive("inner_mm", self.inner_mm)
        if require.positive("outer_mm", self.outer_mm) <= inner:
            raise ValueError(f"outer_mm = {self.outer_mm!r}: must be above inner_mm = {inner:g}")

    @property
    def area_mm2(self) -> float:
        return math.pi * (self.outer_mm**2 - self.inner_mm**2)

    @property
    def reach_mm(self) -> float:
        return float(self.outer_mm)

    @property
    def centroid_mm(self) -> NDArray[np.float64]:
        return np.zeros(2)

    @property
    def covariance_mm2(self) -> NDArray[np.float64]:
        return np.eye(2) * (self.outer_mm**2 + self.inner_mm**2) / 4

    def outline(self) -> shapely.Polygon:
        hole = Disc(self.inner_mm).outline().exterior
        return shapely.Polygon(Disc(self.outer_mm).outline().exterior, [hole])

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        return self.signed_distance(points) <= 0

    def signed_distance(self, points: ArrayLike) -> NDArray[np.float64]:
        radius = np.hypot(*_coordinates(points))
        return np.maximum(self.inner_mm - radius, radius - self.outer_mm)


def sphere_floor_disc(radius: float, antenna_height: float, centre_depth: float, tag_height: float = 0.0) -> Disc:
    """Return the disc that the detection sphere of an antenna cuts from the plane of the tags.

    The sphere's centre lies `centre_depth` below the antenna: eq. 5 of hf_multireader_mcl.

    Parameters
    ----------
    radius : radius of the detection sphere [mm].
    antenna_height : height of the antenna above the floor [mm].
    centre_depth : depth of the sphere's centre below the antenna [mm].
    tag_height : height of the tags above the floor [mm], negative under a covering.

    Raises
    ------
    ValueError : if the sphere does not reach the plane of the tags.
    """
    radius = require.positive("radius", radius)
    antenna_height = require.finite("antenna_height", antenna_height)
    centre_depth = require.finite("centre_depth", centre_depth)
    distance = abs(antenna_height - centre_depth - require.finite("tag_height", tag_height))
    if distance >= radius:
        raise ValueError(f"radius = {radius:g}: must exceed {distance:g} mm, the sphere's distance from the tags")
    return Disc(math.sqrt((radius - distance) * (radius + distance)))


def _coordinates(points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    points = np.asarray(points, dtype=np.float64)
    return points[..., 0], points[..., 1]


def _second_moment(along: float, across: float, corner: float) -> float:
    """Integral of x^2 over a rounded rectangle `along` by `across`: less square corners, plus arcs."""
    middle = along / 2 - corner
    square = corner * ((along / 2) ** 3 - middle**3) / 3
    quarter_disc = math.pi * corner**2 * (middle**2 / 4 + corner**2 / 16) + 2 * middle * corner**3 / 3
    return across * along**3 / 12 + 4 * (quarter_disc - square)
