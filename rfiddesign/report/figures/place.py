"""A place on the floor where a robot stands in figures: among tags, away from walls."""

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign.results.routes import NetworkRecord


def standing_place(navigable: BaseGeometry) -> tuple[float, float]:
    """A place (x, y) [mm] deep inside the area for the robot's centre, off round coordinates."""
    largest = max(shapely.get_parts(navigable), key=lambda part: part.area)
    tolerance = max(1.0, largest.area**0.5 / 100)
    centre = shapely.get_coordinates(shapely.maximum_inscribed_circle(largest, tolerance))[0]
    return float(round(centre[0])) + 17.0, float(round(centre[1])) + 31.0


def place_on_route(network: NetworkRecord) -> tuple[float, float]:
    """The middle of a long leg that leads along x, as robots do in figures [mm]."""
    points = [np.array(edge.points_mm) for edge in network.edges]
    starts, ends = (np.concatenate(parts) for parts in ([p[:-1] for p in points], [p[1:] for p in points]))
    across, along = np.abs(ends - starts)[:, ::-1].T
    best = int(np.argmax(along - 5.0 * across))
    x, y = ((starts[best] + ends[best]) / 2.0).tolist()
    return x, y


@dataclass(frozen=True)
class Window:
    """A rectangle of the floor [mm]."""

    x_min: float
    y_min: float
    x_max: float
    y_max: float


def window_about(x: float, y: float, half_width: float, half_height: float) -> Window:
    """The window centred at a place."""
    return Window(x - half_width, y - half_height, x + half_width, y + half_height)


def inside(points: NDArray[np.float64], window: Window) -> NDArray[np.float64]:
    """The points (m, 2) of (n, 2) inside a window."""
    x, y = points[:, 0], points[:, 1]
    return points[(x >= window.x_min) & (x <= window.x_max) & (y >= window.y_min) & (y <= window.y_max)]
