"""Tag patterns: where the tags of a floor are to lie.

A pattern fills the whole plane and depends on nothing but itself: the tags of a region are the same however the floor
is cut into regions.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from rfiddesign import require
from rfiddesign.floor import prepared_copy
from rfiddesign.geometry.lattice import Lattice, in_reading_order
from rfiddesign.geometry.random_points import hard_core_points, largest_min_distance, lattice_uniform
from rfiddesign.units import MM2_PER_M2


@runtime_checkable
class TagPattern(Protocol):
    """What every tag pattern offers."""

    @property
    def name(self) -> str:
        """Kind of the pattern, as studies call it."""
        ...

    @property
    def tags_per_m2(self) -> float:
        """Mean number of tags per square metre."""
        ...

    @property
    def lattice(self) -> Lattice | None:
        """The lattice that the tags fill without gaps, or None."""
        ...

    @property
    def min_distance_mm(self) -> float:
        """Distance [mm] that no two tags fall short of."""
        ...

    def lay(self, region: BaseGeometry) -> NDArray[np.float64]:
        """Return the tag positions (n, 2) [mm] inside `region`, by y then x; ValueError if they are too many."""
        ...


@dataclass(frozen=True)
class LatticePattern:
    """A tag at every point of a lattice."""

    name: str
    lattice: Lattice

    @property
    def tags_per_m2(self) -> float:
        return MM2_PER_M2 / self.lattice.cell_area_mm2

    @property
    def min_distance_mm(self) -> float:
        return self.lattice.min_distance_mm

    def lay(self, region: BaseGeometry) -> NDArray[np.float64]:
        return self.lattice.lay(region)


@dataclass(frozen=True)
class ThinnedPattern:
    """A lattice of which every tag stays with probability `keep`, drawn from `seed` and the tag's place alone."""

    base: LatticePattern
    keep: float
    seed: int = 0

    name = "thinned"
    lattice = None

    def __post_init__(self):
        if require.positive("keep", self.keep) > 1:
            raise ValueError(f"keep = {self.keep!r}: must be a share above 0 and at most 1")
        require.seed("seed", self.seed)

    @property
    def tags_per_m2(self) -> float:
        return self.keep * self.base.tags_per_m2

    @property
    def min_distance_mm(self) -> float:
        return self.base.min_distance_mm

    def lay(self, region: BaseGeometry) -> NDArray[np.float64]:
        indices = self.base.lattice.indices_within(region)
        kept = indices[lattice_uniform(self.seed, indices) < self.keep]
        return in_reading_order(self.base.lattice.at(kept))


@dataclass(frozen=True)
class RandomPattern:
    """Tags at random, none closer than `min_distance_mm` to another, see `random_points.hard_core_points`."""

    tags_per_m2: float
    min_distance_mm: float
    seed: int = 0

    name = "random"
    lattice = None

    def __post_init__(self):
        density = require.positive("tags_per_m2", self.tags_per_m2)
        largest = largest_min_distance(density / MM2_PER_M2)
        if require.not_negative("min_distance_mm", self.min_distance_mm) > largest:
            raise ValueError(
                f"min_distance_mm = {self.min_distance_mm:g}: must be at most {largest:.6g} at {density:g} tags_per_m2"
            )
        require.seed("seed", self.seed)

    def lay(self, region: BaseGeometry) -> NDArray[np.float64]:
        return hard_core_points(region, self.tags_per_m2 / MM2_PER_M2, self.min_distance_mm, self.seed)


@dataclass(frozen=True, eq=False)
class ListedPattern:
    """Tags at listed positions `points_mm` (n, 2) [mm], such as an existing or hand-made installation."""

    points_mm: NDArray[np.float64] = field(repr=False)

    name = "list"
    lattice = None

    def __post_init__(self):
        points = np.array(self.points_mm, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2 or len(points) == 0 or not np.isfinite(points).all():
            raise ValueError(f"points_mm of shape {points.shape}: must be at least one finite position (x, y)")
        points.setflags(write=False)
        object.__setattr__(self, "points_mm", points)

    @property
    def min_distance_mm(self) -> float:
        if len(self.points_mm) < 2:
            return math.inf
        return float(cKDTree(self.points_mm).query(self.points_mm, k=2)[0][:, 1].min())

    @property
    def tags_per_m2(self) -> float:
        """Tags per square metre of their convex hull; nan where that has no area."""
        hull_mm2 = shapely.MultiPoint(self.points_mm).convex_hull.area
        return MM2_PER_M2 * len(self.points_mm) / hull_mm2 if hull_mm2 > 0 else math.nan

    def lay(self, region: BaseGeometry) -> NDArray[np.float64]:
        return in_reading_order(self.points_mm[shapely.intersects_xy(prepared_copy(region), self.points_mm)])


def make_pattern(
    kind: str,
    *,
    tags_per_m2: float | None = None,
    pitch_mm: float | None = None,
    seed: int = 0,
    row_ratio: float | None = None,
    stagger: float | None = None,
    keep: float | None = None,
    min_distance_mm: float | None = None,
    points_mm: ArrayLike | None = None,
) -> TagPattern:
    """Build the pattern that a study asks for, by density or by pitch.

    Parameters
    ----------
    kind : "square"; "triangular"; "striped", rows along x `row_ratio` pitches apart; "staggered", such rows of which
        each is shifted by `stagger` pitches against the one before; "thinned", a square lattice of
        which a random share `keep` stays; "random"; or "list".
    tags_per_m2 : density of the tags that remain.
    pitch_mm : distance between neighbours of a lattice (of a row, if striped or staggered; before thinning, if
        thinned) [mm]; of a random pattern the pitch of a square one as dense. Give exactly one of density and pitch,
        none for a list.
    seed : seed of a random or thinned pattern.
    row_ratio : 3 unless given if striped, 1 if staggered.
    stagger : for staggered rows, from 0 to below 1; 1/2 unless given.
    keep : share of a thinned pattern's tags that stay; 1/2 unless given.
    min_distance_mm : smallest distance between random tags [mm]; half the pitch unless given.
    points_mm : positions (n, 2) of a list.

    Raises
    ------
    ValueError : if the kind is unknown or an argument is missing, foreign to the kind or out of bounds.
    """
    if kind not in PATTERN_KINDS:
        raise ValueError(f"pattern = {kind!r}: must be one of {', '.join(PATTERN_KINDS)}")
    options = {
        "row_ratio": row_ratio,
        "stagger": stagger,
        "keep": keep,
        "min_distance_mm": min_distance_mm,
        "points_mm": points_mm,
    }
    given = {name: value for name, value in options.items() if value is not None}
    build, own_options = PATTERN_KINDS[kind]
    for name in given:
        if name not in own_options:
            raise ValueError(f"{name}: has no meaning for pattern {kind!r}")
    if kind == "list":
        if points_mm is None or tags_per_m2 is not None or pitch_mm is not None:
            raise ValueError("points_mm: a pattern 'list' needs it, and neither tags_per_m2 nor pitch_mm")
        return ListedPattern(points_mm)
    if (tags_per_m2 is None) == (pitch_mm is None):
        raise ValueError(f"tags_per_m2 = {tags_per_m2!r}, pitch_mm = {pitch_mm!r}: give exactly one of them")
    density = None if tags_per_m2 is None else require.positive("tags_per_m2", tags_per_m2)
    pitch = None if pitch_mm is None else require.positive("pitch_mm", pitch_mm)
    return build(density, pitch, seed, **given)


def displaced(points: ArrayLike, sigma_mm: float, seed: int) -> NDArray[np.float64]:
    """Return points (n, 2) with an installation error: Gaussian of `sigma_mm` [mm] along each axis."""
    points = np.asarray(points, dtype=np.float64)
    generator = np.random.Generator(np.random.PCG64(require.seed("seed", seed)))
    return points + require.not_negative("sigma_mm", sigma_mm) * generator.standard_normal(points.shape)


def _square(density: float | None, pitch: float | None, seed: int) -> LatticePattern:
    pitch = _pitch_mm(density, pitch, 1.0)
    return LatticePattern("square", Lattice(((pitch, 0.0), (0.0, pitch))))


def _triangular(density: float | None, pitch: float | None, seed: int) -> LatticePattern:
    pitch = _pitch_mm(density, pitch, 2 / math.sqrt(3))
    return LatticePattern("triangular", Lattice(((pitch, 0.0), (pitch / 2, pitch * math.sqrt(3) / 2))))


def _striped(density: float | None, pitch: float | None, seed: int, row_ratio: float = 3.0) -> LatticePattern:
    row_ratio = require.positive("row_ratio", row_ratio)
    pitch = _pitch_mm(density, pitch, 1 / row_ratio)
    return LatticePattern("striped", Lattice(((pitch, 0.0), (0.0, row_ratio * pitch))))


def _staggered(
    density: float | None, pitch: float | None, seed: int, row_ratio: float = 1.0, stagger: float = 0.5
) -> LatticePattern:
    row_ratio = require.positive("row_ratio", row_ratio)
    if require.not_negative("stagger", stagger) >= 1:
        raise ValueError(f"stagger = {stagger!r}: must be at least 0 and below 1")
    pitch = _pitch_mm(density, pitch, 1 / row_ratio)
    return LatticePattern("staggered", Lattice(((pitch, 0.0), (stagger * pitch, row_ratio * pitch))))


def _thinned(density: float | None, pitch: float | None, seed: int, keep: float = 0.5) -> ThinnedPattern:
    return ThinnedPattern(_square(None, _pitch_mm(density, pitch, require.positive("keep", keep)), seed), keep, seed)


def _random(
    density: float | None, pitch: float | None, seed: int, min_distance_mm: float | None = None
) -> RandomPattern:
    density = MM2_PER_M2 / pitch**2 if density is None else density
    return RandomPattern(density, 500 / math.sqrt(density) if min_distance_mm is None else min_distance_mm, seed)


def _pitch_mm(density: float | None, pitch: float | None, tags_per_square: float) -> float:
    """Return the pitch, where a square of one pitch a side holds `tags_per_square` on average."""
    return pitch if density is None else 1000 * math.sqrt(tags_per_square / density)


#: Each kind of pattern with its builder and the options that are its own.
PATTERN_KINDS: dict[str, tuple[Callable[..., TagPattern], tuple[str, ...]]] = {
    "square": (_square, ()),
    "triangular": (_triangular, ()),
    "random": (_random, ("min_distance_mm",)),
    "striped": (_striped, ("row_ratio",)),
    "staggered": (_staggered, ("row_ratio", "stagger")),
    "thinned": (_thinned, ("keep",)),
    "list": (ListedPattern, ("points_mm",)),
}
