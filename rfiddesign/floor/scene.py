"""A scene: a floor with UHF tags on walls and shelves, and what stands in the way of their waves."""

import math
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from rfiddesign import require
from rfiddesign.floor.plan import Floor

#: What an obstacle is made of decides what it takes from a wave.
MATERIALS = ("wall", "shelf")
#: Tags of a scene; a field of read probabilities has this many columns.
MAX_TAGS = 100_000
#: How far in front of its surface a tag sits [mm], so that the surface does not block it.
OFF_SURFACE_MM = 10.0


@dataclass(frozen=True)
class Obstacle:
    """Something that blocks waves.

    Parameters
    ----------
    outline : polygon without holes [mm].
    material : "wall" or "shelf" (of metal).
    """

    outline: Polygon
    material: str

    def __post_init__(self) -> None:
        if not isinstance(self.outline, Polygon) or self.outline.is_empty or not self.outline.is_valid:
            raise ValueError("outline is not a valid polygon with an area")
        if len(self.outline.interiors):
            raise ValueError(f"outline has {len(self.outline.interiors)} holes, must have none")
        if self.material not in MATERIALS:
            raise ValueError(f"material is {self.material!r}, must be one of {', '.join(MATERIALS)}")


@dataclass(frozen=True, eq=False)
class SceneTags:
    """Tags on upright surfaces.

    Parameters
    ----------
    positions : (n, 2) x, y [mm].
    facing : (n,) direction of the normal of the surface that each sits on [rad].
    heights : (n,) height above the floor [mm].
    """

    positions: NDArray[np.float64]
    facing: NDArray[np.float64]
    heights: NDArray[np.float64]

    def __post_init__(self) -> None:
        positions, facing, heights = (np.array(a, float) for a in (self.positions, self.facing, self.heights))
        n = len(positions)
        if positions.shape != (n, 2) or facing.shape != (n,) or heights.shape != (n,):
            raise ValueError(
                f"positions, facing, heights have shapes {positions.shape}, {facing.shape}, {heights.shape};"
                " must be (n, 2), (n,), (n,)"
            )
        if n > MAX_TAGS:
            raise ValueError(f"positions: there are {n:,} tags, at most {MAX_TAGS:,} are allowed")
        if not all(np.isfinite(a).all() for a in (positions, facing, heights)):
            raise ValueError("positions, facing, heights: must be finite numbers")
        for name, array in (("positions", positions), ("facing", facing), ("heights", heights)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.positions)

    def chosen(self, which: NDArray) -> "SceneTags":
        """Some of the tags, by index or mask."""
        return SceneTags(self.positions[which], self.facing[which], self.heights[which])


@dataclass(frozen=True, eq=False)
class Scene:
    """A floor to drive on, tags around it, and what blocks their waves.

    Parameters
    ----------
    floor : what the robot's body can sweep (`drivable`) and where its centre may be (`navigable`).
    obstacles : what blocks waves.
    tags : where tags are; those inside an obstacle are behind it from everywhere.
    """

    floor: Floor
    obstacles: tuple[Obstacle, ...]
    tags: SceneTags = field(repr=False)

    @property
    def name(self) -> str:
        """The floor's name."""
        return self.floor.name

    @property
    def n_tags(self) -> int:
        """How many tags there are."""
        return len(self.tags)

    def is_buried(self) -> NDArray[np.bool_]:
        """Whether each tag (n,) is inside an obstacle."""
        is_inside = np.zeros(self.n_tags, bool)
        for obstacle in self.obstacles:
            is_inside |= shapely.contains_xy(obstacle.outline, *self.tags.positions.T)
        return is_inside


def tags_on_line(
    begin: tuple[float, float], end: tuple[float, float], n: int, heights: tuple[float, ...],
    off_surface_mm: float = OFF_SURFACE_MM,
) -> SceneTags:  # fmt: skip
    """Tags evenly along a line on a surface, `n` at each height, facing to the left of the way from begin to end.

    Parameters
    ----------
    begin, end : ends of the line [mm].
    n : tags at each height; each is in the middle of its share of the line.
    heights : heights above the floor [mm].
    off_surface_mm : distance of the tags from the surface, negative behind it [mm].
    """
    n = require.count("n", n, at_most=MAX_TAGS)
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    length = math.hypot(dx, dy)
    require.positive("length of the line", length)
    share = (np.arange(n) + 0.5) / n
    x = begin[0] + share * dx - off_surface_mm * dy / length
    y = begin[1] + share * dy + off_surface_mm * dx / length
    positions = np.tile(np.column_stack([x, y]), (len(heights), 1))
    facing = np.full(len(positions), math.atan2(dx, -dy))
    return SceneTags(positions, facing, np.repeat(np.array(heights, float), n))


def joined(parts: list[SceneTags]) -> SceneTags:
    """Several lists of tags as one."""
    return SceneTags(
        np.concatenate([part.positions for part in parts]),
        np.concatenate([part.facing for part in parts]),
        np.concatenate([part.heights for part in parts]),
    )
