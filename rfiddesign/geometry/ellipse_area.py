"""An elliptic detection area."""

import math
from dataclasses import dataclass

import numpy as np
import shapely.affinity
from numpy.typing import ArrayLike, NDArray

from rfiddesign import require
from rfiddesign.geometry.areas import Disc

MAX_STEPS = 200


@dataclass(frozen=True)
class Ellipse:
    """An ellipse about the antenna's centre with semi-axes `semi_x_mm` along x and `semi_y_mm` along y."""

    semi_x_mm: float
    semi_y_mm: float

    def __post_init__(self):
        require.positive("semi_x_mm", self.semi_x_mm)
        require.positive("semi_y_mm", self.semi_y_mm)

    @property
    def area_mm2(self) -> float:
        return math.pi * self.semi_x_mm * self.semi_y_mm

    @property
    def reach_mm(self) -> float:
        return float(max(self.semi_x_mm, self.semi_y_mm))

    @property
    def centroid_mm(self) -> NDArray[np.float64]:
        return np.zeros(2)

    @property
    def covariance_mm2(self) -> NDArray[np.float64]:
        return np.diag([self.semi_x_mm**2, self.semi_y_mm**2]) / 4

    def outline(self) -> shapely.Polygon:
        return shapely.affinity.scale(Disc(1.0).outline(), self.semi_x_mm, self.semi_y_mm, origin=(0, 0))

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        x, y = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
        return (x / self.semi_x_mm) ** 2 + (y / self.semi_y_mm) ** 2 <= 1

    def signed_distance(self, points: ArrayLike) -> NDArray[np.float64]:
        x, y = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
        distance = _distance_to_ellipse(np.abs(x), np.abs(y), self.semi_x_mm, self.semi_y_mm)
        return np.where(self.contains(points), -distance, distance)


def _distance_to_ellipse(x: NDArray, y: NDArray, semi_x: float, semi_y: float) -> NDArray[np.float64]:
    """Distance of points of the first quadrant to the ellipse's border, within rounding.

    The nearest border point is (a^2 x / (a^2 + t), b^2 y / (b^2 + t)) where the largest root t of
    f(t) = (a x / (a^2 + t))^2 + (b y / (b^2 + t))^2 - 1 puts it on the ellipse (Eberly, "Distance from a point to an
    ellipse"). f falls and is convex, so that Newton's method climbs to the root from any t below it. On flat ellipses
    the root may be many times the first denominator away; a step then makes it half as large again.
    """
    if semi_x < semi_y:
        x, y, semi_x, semi_y = y, x, semi_y, semi_x
    # At y = 0 the denominators vanish; a shift by 1e-12 of the axis moves the distance by no more than that.
    y = np.maximum(y, 1e-12 * semi_y)
    gap = semi_x**2 - semi_y**2
    below = np.maximum(semi_y * y, semi_x * x - gap)  # b^2 + t, kept as one number since t cancels near y = 0
    for _ in range(MAX_STEPS):
        cosine = semi_x * x / (below + gap)
        sine = semi_y * y / below
        slope = cosine**2 / (below + gap) + sine**2 / below
        step = (cosine**2 + sine**2 - 1) / (2 * slope)
        # What has arrived stays, so that a point's distance does not depend on its company.
        is_climbing = step > 4 * np.finfo(float).eps * below
        if not np.any(is_climbing):
            break
        below = np.where(is_climbing, below + step, below)
    return np.hypot(x - semi_x**2 * x / (below + gap), y - semi_y**2 * y / below)
