"""A look-up table of a detection field over antenna poses, for estimators that ask thousands of poses at a time."""

import math
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from rfiddesign import require
from rfiddesign.floor import prepared_copy
from rfiddesign.models._fingerprint_table_kernels import MIDDLE, N_LEVELS, PER_LEVEL, TAG_BITS, pack
from rfiddesign.models.detection_field import DetectionField
from rfiddesign.models.fingerprint import FingerprintField

MAX_TAGS = 1 << TAG_BITS
MAX_ROWS = 20_000_000
# Entries of the table, of 4 bytes: 1 GB.
MAX_ENTRIES = 250_000_000
# Entries worked out at a time.
_CHUNK = 4_000_000


@dataclass(frozen=True)
class TableGrid:
    """Resolution of a look-up table (uhf_snapshots, section IV-B: 0.1 m, 10 degrees).

    Parameters
    ----------
    cell_mm : side of a cell.
    n_headings : headings per turn.
    least_support : poses with fewer training snapshots about them (the sum of their kernels) count as untrained.
    """

    cell_mm: float = 100.0
    n_headings: int = 36
    least_support: float = 1.0

    def __post_init__(self) -> None:
        require.within("cell_mm", self.cell_mm, low=5.0, high=5000.0)
        require.count("n_headings", self.n_headings, at_most=360)
        require.within("least_support", self.least_support, low=0.0, high=1e6)


@dataclass(frozen=True, eq=False)
class FingerprintTable:
    """Chance of every tag by cell and heading; row `cell_row` n_headings + heading, see `_fingerprint_table_kernels`.

    Parameters
    ----------
    grid : its resolution.
    n_tags : number of tags.
    origin_mm : (x, y) of the first cell's corner.
    cell_row : (n_y, n_x) int32 number of a cell, -1 where no antenna can be.
    start : (n_rows + 1,) int64 where the entries of a row begin.
    entries : uint32, level and tag, by falling level.
    bases : (n_rows,) uint16 level of all tags that a row does not list; `UNTRAINED`: the row knows nothing.
    """

    grid: TableGrid
    n_tags: int
    origin_mm: tuple[float, float]
    cell_row: np.ndarray = field(repr=False)
    start: np.ndarray = field(repr=False)
    entries: np.ndarray = field(repr=False)
    bases: np.ndarray = field(repr=False)

    @property
    def n_bytes(self) -> int:
        """Memory of the table [bytes]."""
        return self.cell_row.nbytes + self.start.nbytes + self.entries.nbytes + self.bases.nbytes

    @property
    def compiled(self) -> tuple:
        """The table for compiled code: (cell_row, start, entries, bases, x0, y0, cells per mm, n_headings)."""
        x0, y0 = self.origin_mm
        return (
            self.cell_row, self.start, self.entries, self.bases, float(x0), float(y0), 1.0 / self.grid.cell_mm,
            self.grid.n_headings,
        )  # fmt: skip


def tabulate(detection: DetectionField, where: BaseGeometry, grid: TableGrid | None = None) -> FingerprintTable:
    """Tabulate a detection field over the cells whose middle lies in `where` (of antennas [mm]).

    Rows of a `FingerprintField` without enough snapshots about them are marked as untrained; any other field is taken
    to know all poses.

    Raises
    ------
    ValueError : if the field has too many tags, or the table would have too many rows or entries.
    """
    grid = grid or TableGrid()
    if not 1 <= detection.n_tags <= MAX_TAGS:
        raise ValueError(f"n_tags is {detection.n_tags:,}, must be from 1 to {MAX_TAGS:,} for a table")
    low_x, low_y, high_x, high_y = where.bounds
    n_x, n_y = (math.ceil((high - low) / grid.cell_mm) for low, high in ((low_x, high_x), (low_y, high_y)))
    if n_x * n_y * grid.n_headings > MAX_ROWS:
        raise ValueError(
            f"cell_mm = {grid.cell_mm:g} makes {n_x * n_y * grid.n_headings:,} rows, must be {MAX_ROWS:,} at most"
        )
    x = low_x + (np.arange(n_x) + 0.5) * grid.cell_mm
    y = low_y + (np.arange(n_y) + 0.5) * grid.cell_mm
    centres = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    is_in = shapely.contains_xy(prepared_copy(where), centres[:, 0], centres[:, 1])
    cell_row = np.where(is_in, np.cumsum(is_in) - 1, -1).astype(np.int32).reshape(n_y, n_x)
    headings = 2 * math.pi * np.arange(grid.n_headings) / grid.n_headings
    parts = _rows(detection, centres[is_in], headings, grid.least_support, grid.cell_mm)
    entries, lengths, bases = (np.concatenate(column) for column in zip(*parts, strict=True))
    start = np.concatenate([[0], np.cumsum(lengths)])
    return FingerprintTable(grid, detection.n_tags, (low_x, low_y), cell_row, start, entries, bases)


def _rows(
    detection: DetectionField, centres: np.ndarray, headings: np.ndarray, least_support: float, cell_mm: float
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Entries, their number and the base of each row, in chunks."""
    parts, n_entries = [(np.empty(0, np.uint32), np.empty(0, np.int64), np.empty(0, np.uint16))], 0
    n_cells = max(1, _CHUNK // (len(headings) * detection.n_tags))
    for begin in range(0, len(centres), n_cells):
        chunk = centres[begin : begin + n_cells]
        poses = np.column_stack([np.repeat(chunk, len(headings), axis=0), np.tile(headings, len(chunk))])
        if isinstance(detection, FingerprintField):
            chances, support = detection.with_support(poses)
        else:
            chances, support = detection.read_probability(poses), np.full(len(poses), np.inf)
        room = np.empty(chances.size, np.uint32)
        lengths, bases = np.empty(len(poses), np.int64), np.empty(len(poses), np.uint16)
        n = pack(np.ascontiguousarray(chances, np.float32), support, least_support, room, lengths, bases)
        n_entries += n
        if n_entries > MAX_ENTRIES:
            raise ValueError(
                f"cell_mm = {cell_mm:g} makes more than {MAX_ENTRIES:,} entries: must be larger, or n_headings fewer"
            )
        parts.append((room[:n].copy(), lengths, bases))
    return parts


def level_chances() -> np.ndarray:
    """The chance that each level stands for, shape (N_LEVELS,)."""
    return 1.0 / (1.0 + np.exp(-(np.arange(N_LEVELS) - MIDDLE) / PER_LEVEL))
