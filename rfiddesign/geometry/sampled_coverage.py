"""Coverage of patterns that do not repeat, by quasi-random poses on a patch of floor."""

import math
from functools import lru_cache

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from rfiddesign.geometry.areas import DetectionArea
from rfiddesign.geometry.layouts import ReaderLayout
from rfiddesign.geometry.patterns import ListedPattern, TagPattern
from rfiddesign.geometry.se2 import compose, to_local

#: The patch is cut into tiles by tiles; their scatter tells the error, the pattern's own randomness included.
TILES = 4
POSES_PER_TILE = 2048
#: Side of a tile in mean distances between tags, where the pattern has no end of its own.
TILE_PITCHES = 40
#: Antennas looked up at a time, which bounds memory.
CHUNK = 65_536
SEED = 20_240_229
#: Antennas and layouts of about the same reach share their patches, of half a megabyte.
MARGIN_STEP_MM = 500.0
PATCHES_KEPT = 16


def sampled_levels(
    layout: ReaderLayout, area: DetectionArea, pattern: TagPattern, k_max: int
) -> tuple[NDArray[np.float64], float]:
    """Return coverage (k_max + 2,), as `coverage_by_heading` lists it, over a patch of `pattern`, and its error.

    The patch is the box around a listed pattern's tags, else a square of some 25,000 tags. The error is the largest
    standard error of the results, from the scatter of 16 tiles of the patch.
    """
    tiles = _tiles(layout, area, pattern)
    reach = area.reach_mm + float(np.hypot(*layout.poses_mm[:, :2].T).max())
    tree = _tags_around(pattern, (*tiles[0, :2], *tiles[-1, 2:]), MARGIN_STEP_MM * math.ceil(reach / MARGIN_STEP_MM))
    rng = np.random.Generator(np.random.PCG64(SEED))
    levels = np.array([_tile_levels(layout, area, tree, tile, rng.random(3), k_max) for tile in tiles])
    return levels.mean(axis=0), float((levels.std(axis=0, ddof=1) / math.sqrt(len(tiles))).max())


@lru_cache(maxsize=PATCHES_KEPT)
def _tags_around(pattern: TagPattern, bounds: tuple[float, float, float, float], margin: float) -> cKDTree:
    """The tags within `margin` of a box; what a pattern has in a place does not depend on how much of it is laid."""
    tags = pattern.lay(shapely.box(*bounds).buffer(margin, join_style="mitre"))
    if len(tags) == 0:
        raise ValueError(f"pattern = {pattern.name}: must have at least one tag to be covered")
    return cKDTree(tags)


def _tiles(layout: ReaderLayout, area: DetectionArea, pattern: TagPattern) -> NDArray:
    """Return boxes (TILES^2, 4) x0, y0, x1, y1, the first at the lower left, the last at the upper right."""
    if isinstance(pattern, ListedPattern):
        points = np.asarray(pattern.points_mm, dtype=np.float64)
        lower, upper = points.min(axis=0), points.max(axis=0)
    else:
        lower, upper = np.zeros(2), np.full(2, TILES * TILE_PITCHES * 1000 / math.sqrt(pattern.tags_per_m2))
    side = (upper - lower) / TILES
    corner = lower + side * np.stack(np.meshgrid(np.arange(TILES), np.arange(TILES)), axis=-1).reshape(-1, 2)
    return np.hstack([corner, corner + side])


def _tile_levels(
    layout: ReaderLayout, area: DetectionArea, tree: cKDTree, tile: NDArray, shift: NDArray, k_max: int
) -> NDArray:
    poses = spread(POSES_PER_TILE, shift) * [*(tile[2:] - tile[:2]), 2 * math.pi] + [*tile[:2], 0.0]
    return view_levels(layout, area, tree, poses, k_max)


def view_levels(
    layout: ReaderLayout, area: DetectionArea, tree: cKDTree, poses: NDArray, k_max: int
) -> NDArray[np.float64]:
    """What the antennas see of the tags in `tree` from poses (n, 3), as `coverage_by_heading` lists it."""
    antennas = compose(poses[:, None], layout.poses_mm).reshape(-1, 3)
    chunks = [antennas[at : at + CHUNK] for at in range(0, len(antennas), CHUNK)]
    in_view = np.concatenate([_tags_in_view(chunk, area, tree) for chunk in chunks]).reshape(len(poses), -1)
    readers = (in_view > 0).sum(axis=1)
    at_least = [float((readers >= k).mean()) for k in range(1, k_max + 1)]
    return np.array([*at_least, readers.mean(), (in_view > 1).any(axis=1).mean()])


def _tags_in_view(antennas: NDArray, area: DetectionArea, tree: cKDTree) -> NDArray:
    near = cKDTree(antennas[:, :2]).sparse_distance_matrix(tree, area.reach_mm + 1e-6, output_type="ndarray")
    is_seen = area.contains(to_local(antennas[near["i"]], tree.data[near["j"]]))
    return np.bincount(near["i"][is_seen], minlength=len(antennas))


def spread(n: int, shift: NDArray) -> NDArray:
    """Return n points (n, d) evenly spread over the unit cube of d = len(shift) dimensions.

    Multiples of the powers of the root of x^(d + 1) = x + 1 (M. Roberts, "The unreasonable effectiveness of
    quasirandom sequences", 2018).
    """
    root = 1.0
    for _ in range(64):
        root = (1.0 + root) ** (1.0 / (len(shift) + 1))
    return (shift + np.arange(n)[:, None] / root ** np.arange(1, len(shift) + 1)) % 1.0
