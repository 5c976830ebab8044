"""What reader placement asks: antenna, robot, lattice of tags, and how far the robot may drive before its reads."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rfiddesign import require
from rfiddesign.catalog import Antenna
from rfiddesign.geometry import Disc, TagPattern
from rfiddesign.geometry.lattice import Lattice
from rfiddesign.geometry.mounting import TOLERANCE_MM
from rfiddesign.geometry.symmetry import lattice_order

#: Directions of travel against the robot's heading [rad]; None: it turns on the spot, to the left.
MOTIONS: dict[str, float | None] = {"forward": 0.0, "sideways": math.pi / 2, "turning": None}
MAX_MOUNTS = 20_000
#: Housings keep this far [mm] inside the footprint, which elsewhere is a polygon of many sides.
INSIDE_MM = 0.01


@dataclass(frozen=True)
class PlacementProblem:
    """Where to mount antennas so that reads come within a distance, from every phase of the tags and every heading.

    A robot that moves from any pose in one of the motions passes, before it has gone `distance_mm`, tags with at least
    `n_reads` different antennas.  Forward and backward are alike, and so are left and right: the same floor is swept.

    Parameters
    ----------
    antenna : of every reader, mounted along the robot's axes.  It must see a disc or another convex area.
    pattern : of the tags; a lattice.
    distance_mm : driven straight on before the reads have come [mm].
    footprint_radius_mm : radius of the disc that housings must keep inside [mm].
    n_reads : how many different antennas must read.
    motions : names of `MOTIONS`.
    is_one_dead : whether all this must hold with any one reader dead.
    grid_mm : distance between mount points, a square grid about the robot's centre [mm].
    keep_outs : boxes x0, y0, x1, y1 under the robot that housings must not enter [mm].
    turn_deg : turned on the spot, to the left, before the reads have come [deg].

    Raises
    ------
    ValueError : if a number is out of bounds, the tags lie on no lattice, or the antenna's area does not serve.
    """

    antenna: Antenna
    pattern: TagPattern
    distance_mm: float
    footprint_radius_mm: float
    n_reads: int = 1
    motions: tuple[str, ...] = ("forward",)
    is_one_dead: bool = False
    grid_mm: float = 25.0
    keep_outs: tuple[tuple[float, float, float, float], ...] = ()
    turn_deg: float = 180.0
    _mounts: NDArray[np.float64] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        require.positive("distance_mm", self.distance_mm)
        require.positive("footprint_radius_mm", self.footprint_radius_mm)
        require.count("n_reads", self.n_reads, at_most=100)
        require.within("turn_deg", self.turn_deg, low=1.0, high=360.0)
        require.positive("grid_mm", self.grid_mm)
        if not self.motions or len(set(self.motions)) < len(self.motions) or set(self.motions) - set(MOTIONS):
            raise ValueError(f"motions = {list(self.motions)}: must be some of {', '.join(MOTIONS)}, each once")
        if self.pattern.lattice is None:
            raise ValueError(f"pattern = {self.pattern.name}: readers are placed over a lattice of tags only")
        area = self.antenna.area
        if not isinstance(area, Disc) and area.outline().convex_hull.area > area.outline().area * (1 + 1e-9):
            raise ValueError(f"antenna = {self.antenna.name}: must see a convex area")
        if not isinstance(area, Disc) and "turning" in self.motions:
            raise ValueError(f"antenna = {self.antenna.name}: must see a disc if motions name turning")
        object.__setattr__(self, "_mounts", self._find_mounts())

    @property
    def lattice(self) -> Lattice:
        """The lattice of the tags."""
        return self.pattern.lattice

    @property
    def basis(self) -> NDArray[np.float64]:
        """Reduced basis (2, 2) of the lattice [mm]."""
        return self.lattice.reduced_basis_mm

    @property
    def sector_rad(self) -> float:
        """Headings from 0 up to this one stand for all: the lattice is the same after a turn by it."""
        return 2 * math.pi / lattice_order(self.lattice)

    @property
    def turn_rad(self) -> float:
        """Turned on the spot before the reads have come [rad]."""
        return math.radians(self.turn_deg)

    @property
    def n_wanted(self) -> int:
        """How many different antennas must read if all live: with one dead, one more."""
        return self.n_reads + self.is_one_dead

    @property
    def mounts(self) -> NDArray[np.float64]:
        """Mount points (n, 2) [mm] in the robot's frame, by x, then y."""
        return self._mounts

    def are_in_conflict(self, one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell whether housings at two mount points (..., 2) [mm] overlap; they may touch."""
        length, width = self.antenna.housing_mm
        apart = np.abs(one - other)
        return (apart[..., 0] < length - TOLERANCE_MM) & (apart[..., 1] < width - TOLERANCE_MM)

    def _find_mounts(self) -> NDArray[np.float64]:
        length, width = self.antenna.housing_mm
        n = math.floor(self.footprint_radius_mm / self.grid_mm)
        if (2 * n + 1) ** 2 > MAX_MOUNTS:
            raise ValueError(f"grid_mm = {self.grid_mm:g}: gives more than {MAX_MOUNTS} mount points, must be larger")
        line = self.grid_mm * np.arange(-n, n + 1)
        x, y = (axis.ravel() for axis in np.meshgrid(line, line, indexing="ij"))
        is_free = np.hypot(np.abs(x) + length / 2, np.abs(y) + width / 2) <= self.footprint_radius_mm - INSIDE_MM
        for x0, y0, x1, y1 in self.keep_outs:
            is_apart = (x + length / 2 <= min(x0, x1)) | (x - length / 2 >= max(x0, x1))
            is_free &= is_apart | (y + width / 2 <= min(y0, y1)) | (y - width / 2 >= max(y0, y1))
        if not is_free.any():
            raise ValueError(f"antenna = {self.antenna.name}: has no mount point under the robot")
        return np.stack([x[is_free], y[is_free]], axis=-1)
