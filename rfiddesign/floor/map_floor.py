"""From a ROS map to the floor that a robot can sweep, and how far that area depends on the map's thresholds."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage
from shapely import affinity
from shapely.geometry.base import BaseGeometry

from rfiddesign.errors import StudyError
from rfiddesign.floor.outlines import outline_cells
from rfiddesign.floor.plan import Floor, check_footprint, largest_part
from rfiddesign.floor.ros_map import OccupancyMap

FREE, UNKNOWN, OCCUPIED = np.uint8(0), np.uint8(1), np.uint8(2)

UNKNOWN_PEAK_FROM = 0.1  # lighter than this is free; ROS writes unknown as grey 205, p = 0.196, Willow as 206
UNKNOWN_PEAK_SHARE = 0.02  # of all cells
LIGHTER_SHARE = 0.005  # unknown is never the lightest peak: that is the free floor
BAND_CELLS = 4_000_000


@dataclass(frozen=True)
class MapThresholds:
    """What counts as occupied, unknown and free.

    Parameters
    ----------
    occupied : a cell of at least this probability is occupied; None takes the map's `occupied_thresh`.
    free : a cell below this probability is free, unless it belongs to the unknown peak. None: `occupied` where the map
        shows a peak of unknown cells (a laser passed the cells in between at least once in three), the map's
        `free_thresh` where it shows none.
    unknown_half_width_grey : greys this close to the unknown peak are unknown.
    speck_pixels : groups of at most so many blocked cells, touching at sides or corners, are dropped as noise.
    """

    occupied: float | None = None
    free: float | None = None
    unknown_half_width_grey: int = 1
    speck_pixels: int = 1

    def __post_init__(self) -> None:
        for argument in ("occupied", "free"):
            value = getattr(self, argument)
            if value is not None and not 0.0 <= value <= 1.0:
                raise ValueError(f"{argument} is {value:g}; allowed is 0 to 1")
        for argument, bound in (("unknown_half_width_grey", 50), ("speck_pixels", 10_000)):
            if not 0 <= getattr(self, argument) <= bound:
                raise ValueError(f"{argument} is {getattr(self, argument)}; allowed is 0 to {bound}")


@dataclass(frozen=True)
class AreaRow:
    """Areas of a map's floor with one threshold changed: `name` = `value`, drivable and navigable area [m2]."""

    name: str
    value: float | None
    area_m2: float
    navigable_m2: float


def unknown_peak(occupancy_map: OccupancyMap, thresholds: MapThresholds | None = None) -> int | None:
    """Find the grey that the map writes for unknown cells; None if no grey stands out.

    It is the most frequent grey between p = 0.1 and occupied, if it holds at least 2 % of the cells and other cells are
    lighter.
    """
    occupied, _ = _limits(occupancy_map, thresholds or MapThresholds(), has_peak=False)
    counts = np.bincount(occupancy_map.grey.ravel(), minlength=256)
    probability = occupancy_map.probability_of_grey()
    candidates = np.where((probability >= UNKNOWN_PEAK_FROM) & (probability < occupied), counts, 0)
    peak = int(candidates.argmax())
    n_lighter = counts[probability < probability[peak] - 1.5 / 255.0].sum()
    n_cells = occupancy_map.grey.size
    is_peak = candidates[peak] >= UNKNOWN_PEAK_SHARE * n_cells and n_lighter >= LIGHTER_SHARE * n_cells
    return peak if is_peak else None


def classify(occupancy_map: OccupancyMap, thresholds: MapThresholds | None = None) -> np.ndarray:
    """Class of each cell: FREE 0, UNKNOWN 1 or OCCUPIED 2, shape (n_rows, n_columns), uint8; row 0 is the top row.

    ROS's thresholds alone fail on maps whose unknown grey is a shade lighter than `free_thresh`: hence the peak.
    """
    thresholds = thresholds or MapThresholds()
    peak = unknown_peak(occupancy_map, thresholds)
    occupied, free = _limits(occupancy_map, thresholds, has_peak=peak is not None)
    probability = occupancy_map.probability_of_grey()
    class_of_grey = np.where(probability >= occupied, OCCUPIED, np.where(probability < free, FREE, UNKNOWN))
    if peak is not None:
        is_near = np.abs(np.arange(256) - peak) <= thresholds.unknown_half_width_grey
        class_of_grey[is_near & (class_of_grey == FREE)] = UNKNOWN
    classes = class_of_grey[occupancy_map.grey]
    if thresholds.speck_pixels:
        groups, _ = ndimage.label(classes != FREE, structure=np.ones((3, 3)))
        is_speck = np.bincount(groups.ravel()) <= thresholds.speck_pixels
        classes[is_speck[groups]] = FREE
    return classes


def floor_from_map(
    occupancy_map: OccupancyMap,
    footprint_radius_mm: float = 300.0,
    thresholds: MapThresholds | None = None,
    *,
    name: str | None = None,
) -> Floor:
    """Turn a map into the floor that a round robot can sweep, in mm in the map's frame.

    Navigable are the free cells whose centre is farther than the footprint's radius from the centre of every blocked
    cell, the largest connected part of them; drivable are the cells within the radius of a navigable one (all of them
    free). A wall along the grid so keeps the footprint's edge exactly clear of its pixels. Opening with the footprint
    removes rays and gaps too narrow for the robot.

    Raises
    ------
    StudyError
        If no free space is left for the robot.
    """
    check_footprint(footprint_radius_mm)
    thresholds = thresholds or MapThresholds()
    navigable, drivable = _swept_cells(occupancy_map, footprint_radius_mm, thresholds)
    if not navigable.any():
        n_free = np.count_nonzero(classify(occupancy_map, thresholds) == FREE)
        problem = (
            f"no free space for a footprint of {footprint_radius_mm:g} mm radius: {n_free} free cells, none wide enough"
        )
        raise StudyError(problem, file=occupancy_map.path)
    return Floor(
        name=occupancy_map.path.parent.name if name is None else name,
        drivable=largest_part(_to_map_frame(outline_cells(drivable), occupancy_map)),
        navigable=largest_part(_to_map_frame(outline_cells(navigable), occupancy_map)),
        source=f"ROS map {occupancy_map.path.name}, footprint radius {footprint_radius_mm:g} mm",
    )


def area_sensitivity(
    occupancy_map: OccupancyMap,
    footprint_radius_mm: float = 300.0,
    thresholds: MapThresholds | None = None,
) -> tuple[AreaRow, ...]:
    """How the areas move when one threshold, the speck size or the footprint changes; the first row is as chosen.

    Areas count cells; 0 where no free space is left. The footprint acts in steps, at the distances between cells'
    centres.
    """
    check_footprint(footprint_radius_mm)
    chosen = thresholds or MapThresholds()
    changes = {
        "occupied": (0.5, 0.8),
        "free": (0.1, 0.196, 0.4),
        "unknown_half_width_grey": (0, 2, 5),
        "speck_pixels": (0, 1, 2, 3, 5),
    }
    rows = [_area_row("chosen", None, occupancy_map, footprint_radius_mm, chosen)]
    for field, values in changes.items():
        for value in values:
            if value != getattr(chosen, field):
                changed = replace(chosen, **{field: value})
                rows.append(_area_row(field, value, occupancy_map, footprint_radius_mm, changed))
    for radius in (footprint_radius_mm + step * occupancy_map.pixel_mm for step in (-1.0, -0.5, 0.5, 1.0)):
        if radius > 0.0:
            rows.append(_area_row("footprint_radius_mm", radius, occupancy_map, radius, chosen))
    return tuple(rows)


def _area_row(
    name: str, value: float | None, occupancy_map: OccupancyMap, footprint_radius_mm: float, thresholds: MapThresholds
) -> AreaRow:
    navigable, drivable = _swept_cells(occupancy_map, footprint_radius_mm, thresholds)
    cell_m2 = occupancy_map.resolution_m**2
    return AreaRow(name, value, float(drivable.sum()) * cell_m2, float(navigable.sum()) * cell_m2)


def _limits(occupancy_map: OccupancyMap, thresholds: MapThresholds, *, has_peak: bool) -> tuple[float, float]:
    """Probability from which a cell is occupied, and below which it is free."""
    occupied = occupancy_map.occupied_thresh if thresholds.occupied is None else thresholds.occupied
    free = thresholds.free
    if free is None:
        free = occupied if has_peak else occupancy_map.free_thresh
    return occupied, min(free, occupied)


def _swept_cells(
    occupancy_map: OccupancyMap, footprint_radius_mm: float, thresholds: MapThresholds
) -> tuple[np.ndarray, np.ndarray]:
    """Cells for the robot's centre and cells that its footprint sweeps, two bool grids."""
    radius_pixels = footprint_radius_mm / occupancy_map.pixel_mm
    blocked = np.pad(
        classify(occupancy_map, thresholds) != FREE, 1, constant_values=True
    )  # beyond the image nothing is known
    groups, n_groups = ndimage.label(~_within(blocked, radius_pixels))
    if n_groups == 0:
        nothing = np.zeros(occupancy_map.grey.shape, dtype=bool)
        return nothing, nothing
    n_cells = np.bincount(groups.ravel())
    navigable = groups == 1 + n_cells[1:].argmax()
    swept = _within(navigable, radius_pixels)
    return navigable[1:-1, 1:-1], swept[1:-1, 1:-1]


def _within(is_source: np.ndarray, radius_pixels: float) -> np.ndarray:
    """Cells whose centre lies within the radius of a source cell's centre.

    In bands of rows, since the distance transform takes 16 bytes per cell.
    """
    n_rows, n_columns = is_source.shape
    halo = int(radius_pixels) + 1
    band = max(1, BAND_CELLS // n_columns - 2 * halo, halo)
    result = np.empty(is_source.shape, dtype=bool)
    for start in range(0, n_rows, band):
        stop = min(start + band, n_rows)
        first = max(start - halo, 0)
        near = is_source[first : stop + halo]
        if not near.any():
            result[start:stop] = False
            continue
        distance = ndimage.distance_transform_edt(~near)
        result[start:stop] = distance[start - first : stop - first] <= radius_pixels + 1e-9
    return result


def _to_map_frame(outline: BaseGeometry, occupancy_map: OccupancyMap) -> BaseGeometry:
    x_m, y_m, yaw = occupancy_map.origin_m_rad
    pixel = occupancy_map.pixel_mm
    cos, sin = np.cos(yaw), np.sin(yaw)
    return affinity.affine_transform(
        outline, [pixel * cos, -pixel * sin, pixel * sin, pixel * cos, x_m * 1e3, y_m * 1e3]
    )
