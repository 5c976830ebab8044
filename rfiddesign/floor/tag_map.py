"""Tags sorted by the cells of a grid: looking up the tags near a point costs the same on 10^3 and on 10^6 tags."""

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rfiddesign.errors import StudyError
from rfiddesign.floor import _tag_map_kernels as kernels
from rfiddesign.floor.plan import MAX_EXTENT_MM

CELLS_PER_TAG = (
    2.0  # over the bounding box; a building fills about half of its box, so a cell inside holds about one tag
)
MAX_TAGS = 50_000_000
ROWS_PER_WRITE = 100_000


@dataclass(frozen=True, eq=False)
class TagMap:
    """Tags of a floor in the order of the grid's cells (row by row from the lower left, within a cell by id).

    A tag lies in cell (column, row) = floor((installed - origin) / cell_mm), taken in double precision (a query
    outside the grid must be clipped to it); the cell's number is row * n_x + column, and its tags are the slots
    cell_start[number] to cell_start[number + 1].

    Parameters
    ----------
    nominal_x, nominal_y : where the plan says the tag lies [mm], shape (n_tags,), float32.
    installed_x, installed_y : where it lies in truth [mm], shape (n_tags,), float32.
    tag_id : index in the order of the input, shape (n_tags,), int32.
    cell_start : first slot of each cell, shape (n_x * n_y + 1,), int32.
    cell_mm : side of a cell [mm].
    origin_mm : lower left corner of the grid [mm].
    n_x, n_y : columns and rows of the grid.
    """

    nominal_x: np.ndarray
    nominal_y: np.ndarray
    installed_x: np.ndarray
    installed_y: np.ndarray
    tag_id: np.ndarray
    cell_start: np.ndarray
    cell_mm: float
    origin_mm: tuple[float, float]
    n_x: int
    n_y: int

    @property
    def n_tags(self) -> int:
        """Number of tags."""
        return len(self.tag_id)


def build_tag_map(nominal_mm: np.ndarray, installed_mm: np.ndarray | None = None) -> TagMap:
    """Sort tags into the cells of a uniform grid over their installed positions.

    Parameters
    ----------
    nominal_mm : planned positions [mm], shape (n_tags, 2); their order gives the ids.
    installed_mm : true positions [mm], shape (n_tags, 2); the planned ones if not given.

    Raises
    ------
    ValueError
        If a shape is wrong, or a coordinate is not finite or beyond 5 km, where float32 gets coarser than 0.5 mm.
    """
    nominal = _as_points("nominal_mm", nominal_mm)
    installed = nominal if installed_mm is None else _as_points("installed_mm", installed_mm)
    if len(installed) != len(nominal):
        raise ValueError(f"installed_mm has {len(installed)} tags; allowed are as many as nominal_mm, {len(nominal)}")
    if len(nominal) == 0:
        no_tags, no_ids = np.empty(0, np.float32), np.empty(0, np.int32)
        return TagMap(no_tags, no_tags, no_tags, no_tags, no_ids, np.zeros(2, np.int32), 1.0, (0.0, 0.0), 1, 1)
    low = installed.min(axis=0).astype(float)
    extent = installed.max(axis=0).astype(float) - low
    cell_mm = _cell_size(extent[0], extent[1], len(nominal))
    n_x, n_y = (int(n) + 1 for n in extent / cell_mm)
    cell_start, order = np.zeros(n_x * n_y + 1, np.int32), np.empty(len(installed), np.int32)
    kernels.sort_into_cells(installed, float(low[0]), float(low[1]), cell_mm, n_x, cell_start, order)
    installed_x, installed_y = installed[order, 0], installed[order, 1]
    is_as_planned = installed is nominal
    return TagMap(
        nominal_x=installed_x if is_as_planned else nominal[order, 0],
        nominal_y=installed_y if is_as_planned else nominal[order, 1],
        installed_x=installed_x,
        installed_y=installed_y,
        tag_id=order,
        cell_start=cell_start,
        cell_mm=cell_mm,
        origin_mm=(float(low[0]), float(low[1])),
        n_x=n_x,
        n_y=n_y,
    )


def visible_tags(tag_map: TagMap, x: float, y: float, reach: float) -> np.ndarray:
    """Ids of the tags whose installed position lies within `reach` of (x, y) [mm], in rising order."""
    x0, y0 = tag_map.origin_mm
    columns = _cell_range(x - x0, reach, tag_map.cell_mm, tag_map.n_x)
    found = []
    for row in _cell_range(y - y0, reach, tag_map.cell_mm, tag_map.n_y):
        if len(columns) == 0:
            break
        # the cells of a row are neighbours, and so are their tags
        start = tag_map.cell_start[row * tag_map.n_x + columns[0]]
        stop = tag_map.cell_start[row * tag_map.n_x + columns[-1] + 1]
        dx = tag_map.installed_x[start:stop].astype(float) - x
        dy = tag_map.installed_y[start:stop].astype(float) - y
        found.append(tag_map.tag_id[start:stop][dx * dx + dy * dy <= reach * reach])
    return np.sort(np.concatenate(found)) if found else np.empty(0, np.int32)


def write_tags_csv(path: str | Path, tag_map: TagMap) -> None:
    """Write `id,x_mm,y_mm` of the planned positions to 0.1 mm, by id. The file appears whole or not at all.

    Raises
    ------
    StudyError
        If the file cannot be written.
    """
    path = Path(path)
    by_id = np.argsort(tag_map.tag_id)
    temporary = None
    try:
        with tempfile.NamedTemporaryFile(
            "w", dir=path.parent, prefix=f".{path.name}.", delete=False, encoding="ascii", newline="\n"
        ) as stream:
            temporary = stream.name
            os.chmod(temporary, 0o644)  # a temporary file is private; the result is for others to read
            stream.write("id,x_mm,y_mm\n")
            for start in range(0, len(by_id), ROWS_PER_WRITE):
                slots = by_id[start : start + ROWS_PER_WRITE]
                ids, xs, ys = (a[slots].tolist() for a in (tag_map.tag_id, tag_map.nominal_x, tag_map.nominal_y))
                stream.writelines([f"{i},{x:.1f},{y:.1f}\n" for i, x, y in zip(ids, xs, ys, strict=True)])
        os.replace(temporary, path)
        temporary = None
    except OSError as error:
        raise StudyError(f"cannot be written: {error.strerror or error}", file=path) from None
    finally:
        if temporary is not None:
            os.unlink(temporary)


def _as_points(argument: str, points: np.ndarray) -> np.ndarray:
    points = np.asarray(points)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"{argument} has shape {points.shape}; allowed is (n_tags, 2)")
    if len(points) > MAX_TAGS:
        raise ValueError(f"{argument} has {len(points)} tags; allowed are {MAX_TAGS}")
    if points.dtype.kind not in "fiu":
        raise ValueError(f"{argument} has type {points.dtype}; allowed are numbers")
    if len(points) and not (points.min() >= -MAX_EXTENT_MM and points.max() <= MAX_EXTENT_MM):
        raise ValueError(f"{argument} has a coordinate that is not finite or beyond {MAX_EXTENT_MM:g} mm")
    return points.astype(np.float32)


def _cell_size(width: float, height: float, n_tags: int) -> float:
    """Side of a cell such that (width / side + 1) (height / side + 1) = 2 n_tags + 2, which bounds their number."""
    n_cells = CELLS_PER_TAG * n_tags + 2.0
    perimeter = width + height
    if perimeter == 0.0:
        return 1.0
    return float((perimeter + np.sqrt(perimeter**2 + 4.0 * width * height * (n_cells - 1.0))) / (2.0 * (n_cells - 1.0)))


def _cell_range(offset: float, reach: float, cell_mm: float, n_cells: int) -> range:
    first = max(int(np.floor((offset - reach) / cell_mm)), 0)
    last = min(int(np.floor((offset + reach) / cell_mm)), n_cells - 1)
    return range(first, last + 1)
