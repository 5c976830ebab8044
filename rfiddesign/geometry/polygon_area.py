"""A detection area of any outline, and what every area with a shapely outline shares."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign.floor import prepared_copy


@dataclass(frozen=True)
class PolygonArea:
    """A simple polygon in the antenna's frame; it need not contain the antenna's centre.

    Parameters
    ----------
    vertices_mm : corners (x, y) [mm] in order, at least three; the last is joined to the first.

    Raises
    ------
    ValueError : if the corners are not finite, or their outline crosses itself or encloses nothing.
    """

    vertices_mm: tuple[tuple[float, float], ...]

    def __post_init__(self):
        vertices = np.asarray(self.vertices_mm, dtype=np.float64)
        if vertices.ndim != 2 or vertices.shape[0] < 3 or vertices.shape[1] != 2 or not np.isfinite(vertices).all():
            raise ValueError(f"vertices_mm of shape {vertices.shape}: must be at least three finite corners (x, y)")
        # Plain tuples make the record hashable, whatever sequence it was given.
        object.__setattr__(self, "vertices_mm", tuple((float(x), float(y)) for x, y in vertices))
        if not (self._outline.is_valid and self._outline.area > 0):
            raise ValueError(f"vertices_mm: must be a simple polygon; {shapely.is_valid_reason(self._outline)}")

    @cached_property
    def _outline(self) -> shapely.Polygon:
        return shapely.Polygon(self.vertices_mm)

    @property
    def area_mm2(self) -> float:
        return float(self._outline.area)

    @property
    def reach_mm(self) -> float:
        return float(np.hypot(*np.transpose(self.vertices_mm)).max())

    @property
    def centroid_mm(self) -> NDArray[np.float64]:
        return shapely.get_coordinates(self._outline.centroid)[0]

    @property
    def covariance_mm2(self) -> NDArray[np.float64]:
        """Second moments of the triangles that the centroid spans with each side, by their exact integrals."""
        start = np.asarray(self.vertices_mm) - self.centroid_mm
        end = np.roll(start, -1, axis=0)
        twice_area = start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]
        both = start + end
        products = [corners[:, :, None] * corners[:, None, :] for corners in (start, end, both)]
        return np.einsum("i,ijk->jk", twice_area, sum(products)) / (12 * twice_area.sum())

    def outline(self) -> shapely.Polygon:
        return self._outline

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        return covers(self._outline, points)

    def signed_distance(self, points: ArrayLike) -> NDArray[np.float64]:
        return signed_distance(self._outline, points)


def covers(outline: BaseGeometry, points: ArrayLike) -> NDArray[np.bool_]:
    """Tell for points (..., 2) whether they lie in `outline` or on its border."""
    points = np.asarray(points, dtype=np.float64)
    return shapely.intersects_xy(prepared_copy(outline), points[..., 0], points[..., 1])


def signed_distance(outline: BaseGeometry, points: ArrayLike) -> NDArray[np.float64]:
    """Return the distance of points (..., 2) to the border of `outline`, negative inside, in the outline's unit."""
    distance = shapely.distance(outline.boundary, shapely.points(np.asarray(points, dtype=np.float64)))
    return np.where(covers(outline, points), -distance, distance)
