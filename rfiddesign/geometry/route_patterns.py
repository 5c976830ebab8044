"""Tag patterns of floors on which robots drive along routes: tags lie on the routes alone."""

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign import require
from rfiddesign.geometry.lattice import Lattice
from rfiddesign.geometry.patterns import ListedPattern, TagPattern, make_pattern
from rfiddesign.units import MM2_PER_M2

#: Patterns of whole floors that may be laid on routes alone.
BASE_KINDS = ("square", "triangular", "random")
ON_ROUTES = {f"{kind}-on-routes": kind for kind in BASE_KINDS}
#: Tags placed along routes for a layout and an antenna.
PLACED = "routes"


@dataclass(frozen=True, eq=False)
class RouteStrip:
    """The strip of floor along routes that robots sweep, and how they drive there.

    Parameters
    ----------
    swath : the strip [mm].
    routes_mm : the routes, polylines (k, 2) [mm].
    lateral_mm, yaw_rad : deviations of robots from their routes, to either side.
    """

    swath: BaseGeometry = field(repr=False)
    routes_mm: tuple[NDArray[np.float64], ...] = field(repr=False)
    lateral_mm: float
    yaw_rad: float


@dataclass(frozen=True, eq=False)
class OnRoutesPattern:
    """A pattern of which only the tags on the strip along routes are laid.

    Parameters
    ----------
    base : the pattern, as it would fill the whole floor.
    strip : the strip.
    """

    base: TagPattern
    strip: RouteStrip

    @property
    def name(self) -> str:
        return f"{self.base.name}-on-routes"

    @property
    def tags_per_m2(self) -> float:
        """Tags per square metre of the strip."""
        return self.base.tags_per_m2

    @property
    def lattice(self) -> Lattice | None:
        """The lattice that the tags fill, on the strip without gaps, or None."""
        return self.base.lattice

    @property
    def min_distance_mm(self) -> float:
        return self.base.min_distance_mm

    def lay(self, region: BaseGeometry) -> NDArray[np.float64]:
        return self.base.lay(self.strip.swath.intersection(region))


@dataclass(frozen=True, eq=False)
class PlacedPattern:
    """Tags placed one by one along routes, for one layout and antenna.

    Parameters
    ----------
    points_mm : where they are (n, 2) [mm].
    distance_mm : the driven distance [mm] within which they were placed to be read.
    strip : the strip along the routes, which is tagged.

    Raises
    ------
    ValueError : if there is no tag, a place is not finite, or the distance is not positive.
    """

    points_mm: NDArray[np.float64] = field(repr=False)
    distance_mm: float
    strip: RouteStrip

    lattice = None

    def __post_init__(self) -> None:
        require.positive("distance_mm", self.distance_mm)
        object.__setattr__(self, "points_mm", self._listed.points_mm)

    @cached_property
    def _listed(self) -> ListedPattern:
        return ListedPattern(self.points_mm)

    @property
    def name(self) -> str:
        return f"{PLACED}-{self.distance_mm:g}"

    @property
    def tags_per_m2(self) -> float:
        """Tags per square metre of the strip."""
        return MM2_PER_M2 * len(self.points_mm) / self.strip.swath.area

    @cached_property
    def min_distance_mm(self) -> float:
        return self._listed.min_distance_mm

    def lay(self, region: BaseGeometry) -> NDArray[np.float64]:
        return self._listed.lay(region)


@dataclass(frozen=True)
class PlannedPattern:
    """Stands for tags that are yet to be placed along routes for each layout and antenna, see `PlacedPattern`."""

    distance_mm: float

    lattice = None
    tags_per_m2 = math.nan
    # Whoever places them keeps the distance that the readers ask for.
    min_distance_mm = math.inf

    def __post_init__(self) -> None:
        require.positive("distance_mm", self.distance_mm)

    @property
    def name(self) -> str:
        return f"{PLACED}-{self.distance_mm:g}"

    def lay(self, region: BaseGeometry) -> NDArray[np.float64]:
        raise ValueError(f"pattern {self.name}: its tags must be placed for a layout and an antenna first")


def on_routes(kind: str, tags_per_m2: float, seed: int, strip: RouteStrip) -> OnRoutesPattern:
    """Build a pattern of `ON_ROUTES` with a density on the strip along routes."""
    if kind not in ON_ROUTES:
        raise ValueError(f"pattern = {kind!r}: must be one of {', '.join(ON_ROUTES)}")
    return OnRoutesPattern(make_pattern(ON_ROUTES[kind], tags_per_m2=tags_per_m2, seed=seed), strip)


def pattern_beneath(pattern: TagPattern) -> TagPattern:
    """What a robot on its way has beneath it: a pattern that fills routes alone is continued to both sides."""
    return pattern.base if isinstance(pattern, OnRoutesPattern) else pattern


def tagged_mm2(pattern: TagPattern, floor_mm2: float) -> float:
    """Area [mm^2] that a pattern has tagged: the strip along routes, or the whole floor."""
    return pattern.strip.swath.area if isinstance(pattern, OnRoutesPattern | PlacedPattern) else floor_mm2
