"""The cover matrix: which tag places serve which windows of travel, under which deviation of the robot."""

import math
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from rfiddesign.geometry import DetectionArea, Disc, ReaderLayout
from rfiddesign.geometry.travel import rotated
from rfiddesign.optimize.tag_placement._cover_kernels import first_alike, row_hashes, undominated
from rfiddesign.optimize.tag_placement._sight_kernels import sightings
from rfiddesign.optimize.tag_placement.rules import PlacementRules
from rfiddesign.optimize.tag_placement.windows import Windows

#: Outlines of areas are drawn with corners left out that change them by less than this [mm].
OUTLINE_MM = 0.25
MAX_SIGHTINGS = 400_000_000


@dataclass(frozen=True, eq=False)
class Sight:
    """What the antennas of a robot see, for each of its deviations from the route.

    Parameters
    ----------
    offsets : (n_deviations, n_antennas, 2) antennas' places along and to the left of the road [mm].
    radius : of the antennas' areas if they are discs, else 0 [mm].
    edges : (n_deviations, n_antennas, m, 4) sides of their outlines otherwise.
    n_alike : (n_deviations,) how many deviations and directions of travel see the same.
    headings : (n_deviations,) robot's heading against the road [rad], of the first of them.
    reach : largest distance of a tag that is seen from the road [mm].
    """

    offsets: NDArray[np.float64]
    radius: float
    edges: NDArray[np.float64]
    n_alike: NDArray[np.int64]
    headings: NDArray[np.float64]
    reach: float


@dataclass(frozen=True, eq=False)
class Cover:
    """The cover problem: choose the fewest places so that every row has as many of them as it needs.

    Parameters
    ----------
    rows : (n_rows, n_places) which places serve a row, all different and each servable.
    columns : the same by place, (n_places, n_rows).
    need : (n_rows,) how many places a row needs.
    number : (n_places,) which of all candidate places these are.
    n_windows, n_unserved : windows times deviations, and those that fewer than `n_cover` places serve, both counted
        before those alike were made one.
    unserved : (n, 3) x, y [mm] and robot's heading [rad] in the middles of the unserved ones, each once.
    """

    rows: csr_array
    columns: csr_array
    need: NDArray[np.int32]
    number: NDArray[np.int64]
    n_windows: int
    n_unserved: int
    unserved: NDArray[np.float64]


def sight_of(layout: ReaderLayout, area: DetectionArea, rules: PlacementRules) -> Sight:
    """Describe what a robot sees beside its road, for every deviation and both directions of travel.

    Raises
    ------
    ValueError : if nothing is left of the antennas' area within the margin.
    """
    is_disc = isinstance(area, Disc)
    radius = area.radius_mm - rules.margin_mm if is_disc else 0.0
    outline = area.outline() if is_disc else area.outline().simplify(OUTLINE_MM).buffer(-rules.margin_mm)
    if outline.is_empty or (is_disc and radius <= 0):
        raise ValueError(f"margin_mm = {rules.margin_mm:g}: leaves nothing of the antennas' detection area")
    # A disc needs no outline; a place that no antenna is at stands for it.
    edges = np.zeros((0, 4)) if is_disc else _edges(outline)
    poses = layout.poses_mm
    offsets, outlines, headings, found = [], [], [], {}
    for heading in (turn + way for turn in rules.headings_rad for way in (0.0, math.pi)):
        for lateral in rules.laterals_mm:
            for yaw in rules.yaws_rad:
                at = rotated(poses[:, :2], heading + yaw) + np.array([0.0, lateral])
                turned = np.array(
                    [rotated(edges.reshape(-1, 2), heading + yaw + a).reshape(-1, 4) for a in poses[:, 2]]
                )
                key = _key(at, turned)
                if key not in found:
                    found[key] = [len(offsets), 0]
                    offsets.append(at)
                    outlines.append(turned)
                    headings.append(heading)
                found[key][1] += 1
    offsets, outlines = np.array(offsets), np.array(outlines)
    reach = float(np.hypot(*offsets.reshape(-1, 2).T).max() + (radius if is_disc else np.hypot(*edges[:, :2].T).max()))
    n_alike = np.array([n for _, n in found.values()], np.int64)
    return Sight(offsets, float(radius), outlines, n_alike, np.array(headings), reach)


def half_width(sight: Sight) -> float:
    """Return how far to either side of a road antennas see [mm]."""
    if sight.radius > 0:
        return float(np.abs(sight.offsets[..., 1]).max() + sight.radius)
    return float(np.abs(sight.offsets[..., 1, None, None] + sight.edges[..., 1::2]).max())


def cover_of(windows: Windows, places: cKDTree, sight: Sight, n_cover: int) -> Cover:
    """Build the cover matrix of the places that are seen along some of the windows.

    Raises
    ------
    ValueError : if it has more entries than memory holds.
    """
    found = _sightings(windows, places, sight)
    n_deviations = len(sight.offsets)
    n_served = np.diff(found.indptr)
    is_served = n_served >= n_cover
    alike = np.tile(sight.n_alike, windows.n_windows)
    unserved = np.flatnonzero(~is_served)
    poses = windows.poses[unserved // n_deviations].copy()
    poses[:, 2] += sight.headings[unserved % n_deviations]
    served = np.flatnonzero(is_served)
    hashes = row_hashes(found.indptr, found.indices, served)
    order = served[np.argsort(hashes, kind="stable")]
    is_first = first_alike(found.indptr, found.indices, order, np.sort(hashes))
    rows = found[np.sort(order[is_first])]
    number = np.unique(rows.indices).astype(np.int64)
    rows = rows[:, number]
    return Cover(
        rows=rows,
        columns=rows.T.tocsr(),
        need=np.full(rows.shape[0], n_cover, np.int32),
        number=number,
        n_windows=int(alike.sum()),
        n_unserved=int(alike[unserved].sum()),
        unserved=np.unique(poses.round(3), axis=0) if len(poses) else np.empty((0, 3)),
    )


def without_dominated(cover: Cover, is_wanted: NDArray | None = None) -> Cover:
    """Leave out places whose rows are all served by so many others each as any row needs, and those that serve none.

    The fewest places that serve all rows stay as few. Not so where places are in conflict. Places `is_wanted`
    (n_places,) stay in any case.
    """
    order = np.argsort(-np.diff(cover.columns.indptr), kind="stable")
    matrix = (cover.rows.indptr, cover.rows.indices, cover.columns.indptr, cover.columns.indices)
    is_kept = undominated(*matrix, order, cover.need.max(initial=1))
    return with_places(cover, is_kept if is_wanted is None else is_kept | is_wanted)


def left_to_serve(cover: Cover, is_laid: NDArray) -> Cover:
    """Return what is left when the places `is_laid` (n_places,) have a tag already: the rest of the places and rows."""
    need = cover.need - cover.rows.astype(np.int32) @ is_laid.astype(np.int32)
    is_open = need > 0
    rows = cover.rows[np.flatnonzero(is_open)]
    return with_places(replace(cover, rows=rows, columns=rows.T.tocsr(), need=need[is_open]), ~is_laid)


def with_places(cover: Cover, is_kept: NDArray) -> Cover:
    """Leave out all places but those `is_kept` (n_places,)."""
    columns = cover.columns[np.flatnonzero(is_kept)]
    return replace(cover, rows=columns.T.tocsr(), columns=columns, number=cover.number[is_kept])


def _sightings(windows: Windows, places: cKDTree, sight: Sight) -> csr_array:
    middles = windows.pieces[:, :2] + windows.pieces[:, 2:4] * windows.pieces[:, 5:] / 2
    lists = places.query_ball_point(middles, windows.pieces[:, 5] / 2 + sight.reach + 1e-6)
    near_start = np.cumsum([0, *(len(near) for near in lists)]).astype(np.int64)
    near = np.fromiter((place for near in lists for place in near), np.int32, int(near_start[-1]))
    stamp = np.zeros(int(windows.count.max(initial=0)), np.int64)

    def written(rows: NDArray, seen: NDArray) -> int:
        stamp[:] = 0
        return sightings(
            windows.pieces, windows.first, windows.count, windows.begins, windows.length, near_start, near, places.data,
            sight.offsets, sight.radius, sight.edges, sight.reach, stamp, rows, seen,
        )  # fmt: skip

    n = written(np.empty(0, np.int32), np.empty(0, np.int32))
    if n > MAX_SIGHTINGS:
        raise ValueError(f"along_mm, across_mm: give {n} sightings of tags, more than {MAX_SIGHTINGS}")
    rows, seen = np.empty(n, np.int32), np.empty(n, np.int32)
    if n:
        written(rows, seen)
    shape = (windows.n_windows * len(sight.offsets), places.n)
    # Repeated sightings are added up, in more than the 127 of an int8.
    found = csr_array((np.ones(n, np.int16), (rows, seen)), shape=shape)
    found.sum_duplicates()
    found.data = np.ones(found.nnz, np.int8)
    return found


def _edges(outline: shapely.geometry.base.BaseGeometry) -> NDArray[np.float64]:
    rings = shapely.get_rings(shapely.get_parts(outline))
    corners = [shapely.get_coordinates(ring) for ring in rings]
    return np.concatenate([np.hstack([ring[:-1], ring[1:]]) for ring in corners])


def _key(offsets: NDArray, edges: NDArray) -> bytes:
    """What is seen, the same for antennas in any order and outlines begun at any corner."""
    if edges.shape[1] == 0:
        drawn = offsets
    else:
        ends = edges.reshape(len(edges), -1, 2, 2) + offsets[:, None, None]
        ends = ends.reshape(-1, 2, 2).round(6) + 0.0
        is_turned = (ends[:, 0, 0] > ends[:, 1, 0]) | (
            (ends[:, 0, 0] == ends[:, 1, 0]) & (ends[:, 0, 1] > ends[:, 1, 1])
        )
        drawn = np.where(is_turned[:, None, None], ends[:, ::-1], ends).reshape(-1, 4)
    drawn = drawn.round(6) + 0.0
    return drawn[np.lexsort(drawn.T)].tobytes()
