"""Drive the routes over the laid tags and see how far it is between reads: a check that knows no windows.

It shares no code with the cover matrix: the robot moves on by small steps, and at each the antennas' areas are asked
which tags lie in them.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from rfiddesign.geometry import DetectionArea, ReaderLayout
from rfiddesign.optimize.tag_placement.rules import PlacementRules

STEP_MM = 4.0
N_RANDOM = 20
#: Sample positions looked at at once.
BLOCK = 2_000_000


@dataclass(frozen=True)
class DriveCheck:
    """Longest distances driven without a read, over all routes, ways through joints and deviations; [mm].

    Each is known to one step of 4 mm. Reads while the robot turns at a bend are not counted, but for those before it
    begins to turn and after.

    Parameters
    ----------
    planned_mm, planned_spare_mm : at the deviations of the rules: with all tags, and with that one tag dead whose loss
        is worst.
    random_mm, random_spare_mm : the same where each drive has a random lateral place and yaw within the rules' bounds,
        also between those that the placement was made for.
    random_share_over : share of these drives' length driven more than the rules' distance after a read, all tags alive.
    n_drives, driven_m : how often all routes were driven, and how far in all [m].
    """

    planned_mm: float
    planned_spare_mm: float
    random_mm: float
    random_spare_mm: float
    random_share_over: float
    n_drives: int
    driven_m: float


def drive_check(
    routes: Sequence[NDArray],
    layout: ReaderLayout,
    area: DetectionArea,
    tags: NDArray,
    rules: PlacementRules,
    seed: int = 0,
) -> DriveCheck:
    """Drive every route, and every way from one route into another, at planned and at random deviations."""
    rng = np.random.default_rng(seed)
    roads = [*routes, *_through_joints(routes, 2 * rules.distance_mm, rng)]
    samples = _samples(roads)
    ways = [turn + way for turn in rules.headings_rad for way in (0.0, math.pi)]
    planned = [(way, lateral, yaw) for way in ways for lateral in rules.laterals_mm for yaw in rules.yaws_rad]
    lateral = rules.lateral_mm if rules.n_laterals > 1 else 0.0
    yaw = rules.yaw_rad if rules.n_yaws > 1 else 0.0
    drawn = [(rng.choice(ways), rng.uniform(-lateral, lateral), rng.uniform(-yaw, yaw)) for _ in range(N_RANDOM)]
    results = []
    for deviations in (planned, drawn):
        found = [_gaps(samples, layout, area, tags, deviation, rules.distance_mm) for deviation in deviations]
        results.append((max(gap for gap, _, _ in found), max(spare for _, spare, _ in found), [s for _, _, s in found]))
    driven = sum(float(np.hypot(*np.diff(road, axis=0).T).sum()) for road in roads)
    n_drives = len(planned) + len(drawn)
    return DriveCheck(
        results[0][0], results[0][1], results[1][0], results[1][1], float(np.mean(results[1][2])), n_drives,
        n_drives * driven / 1e3,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Samples:
    """Steps of all roads, one after the other: place (n, 2), direction and travel (n,), road (n,), the roads' sizes."""

    place: NDArray
    direction: NDArray
    travel: NDArray
    road: NDArray
    sizes: NDArray


def _samples(roads: Sequence[NDArray]) -> _Samples:
    place, direction, travel, number, sizes = [], [], [], [], []
    for at, road in enumerate(roads):
        reached = 0.0
        for start, end in pairwise(road):
            size = math.dist(start, end)
            # At a bend the robot stands before it turns and after.
            steps = np.append(np.arange(0.0, size, STEP_MM), size)
            place.append(start + steps[:, None] / size * (end - start))
            direction.append(np.full(len(steps), math.atan2(end[1] - start[1], end[0] - start[0])))
            travel.append(reached + steps)
            number.append(np.full(len(steps), at))
            reached += size
        sizes.append(reached)
    return _Samples(*(np.concatenate(part) for part in (place, direction, travel, number)), np.array(sizes))


def _through_joints(routes: Sequence[NDArray], reach: float, rng: np.random.Generator) -> Iterator[NDArray]:
    """Yield roads from every route into every other that it meets, about `reach` to either side of the meeting."""
    meeting: dict[tuple[int, int], list[NDArray]] = {}
    for route in routes:
        for leaving in (route, route[::-1]):
            meeting.setdefault(tuple(leaving[0].round().astype(int).tolist()), []).append(leaving)
    for leaving in meeting.values():
        for number, first in enumerate(leaving):
            for second in leaving[:number]:
                before, after = (_onward(way, meeting, reach, rng) for way in (first, second))
                yield np.concatenate([before[::-1], after[1:]])


def _onward(road: NDArray, meeting: dict, reach: float, rng: np.random.Generator) -> NDArray:
    """Follow a road for `reach`, at every end into a random other one, and cut it there."""
    last = road
    while np.hypot(*np.diff(road, axis=0).T).sum() < reach:
        others = meeting[tuple(last[-1].round().astype(int).tolist())]
        others = [way for way in others if not np.array_equal(way, last[::-1])]
        if not others:
            break
        last = others[rng.integers(len(others))]
        road = np.concatenate([road, last[1:]])
    reached = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(road, axis=0).T))])
    end = min(reach, reached[-1])
    cut = np.array([np.interp(end, reached, road[:, axis]) for axis in (0, 1)])
    return np.concatenate([road[reached < end - 1e-6], cut[None]])


def _gaps(samples: _Samples, layout, area, tags, deviation, limit: float) -> tuple[float, float, float]:
    """Return the longest distance without a read, the same with one tag dead, and the share driven over the limit."""
    step, tag = _reads(samples, layout, area, tags, deviation)
    # Of each step that reads: the one tag it depends on, or -1.
    pairs = np.unique(np.stack([step, tag], axis=-1), axis=0)
    steps, first, n_tags = np.unique(pairs[:, 0], return_index=True, return_counts=True)
    only = np.where(n_tags == 1, pairs[first, 1], -1) if len(pairs) else np.empty(0, int)
    longest = longest_spare = over = 0.0
    bounds = np.searchsorted(samples.road[steps], np.arange(len(samples.sizes) + 1)) if len(steps) else None
    for road, size in enumerate(samples.sizes):
        mine = slice(bounds[road], bounds[road + 1]) if bounds is not None else slice(0, 0)
        at = np.concatenate([[0.0], samples.travel[steps[mine]], [size]])
        gaps = np.diff(at)
        longest = max(longest, float(gaps.max()))
        over += float(np.maximum(gaps - limit, 0.0).sum())
        # Runs of reads that hang on one tag vanish with it.
        sole = np.concatenate([[-1], only[mine], [-1]])
        starts = np.flatnonzero(np.append(True, sole[1:] != sole[:-1]) & (sole >= 0))
        ends = np.flatnonzero(np.append(sole[1:] != sole[:-1], True) & (sole >= 0))
        spare = at[ends + 1] - at[starts - 1]
        longest_spare = max(longest_spare, longest, float(spare.max(initial=0.0)))
    return longest, longest_spare, over / float(samples.sizes.sum())


def _reads(samples: _Samples, layout, area, tags, deviation) -> tuple[NDArray, NDArray]:
    """Return steps and tags (n,) of all reads."""
    heading, lateral, yaw = deviation
    poses = layout.poses_mm
    reach = float(np.hypot(*poses[:, :2].T).max()) + area.reach_mm
    left = np.stack([-np.sin(samples.direction), np.cos(samples.direction)], axis=-1)
    centre = samples.place + lateral * left
    facing = samples.direction + heading + yaw
    near = cKDTree(centre).query_ball_point(tags, reach + 1e-6) if len(tags) else []
    tag = np.repeat(np.arange(len(tags)), [len(steps) for steps in near])
    step = np.fromiter((at for steps in near for at in steps), np.int64, len(tag))
    found = [(np.empty(0, np.int64), np.empty(0, np.int64))]
    for begin in range(0, len(step), BLOCK):
        s, t = step[begin : begin + BLOCK], tag[begin : begin + BLOCK]
        offset = tags[t] - centre[s]
        cosine, sine = np.cos(facing[s]), np.sin(facing[s])
        ahead, aside = cosine * offset[:, 0] + sine * offset[:, 1], cosine * offset[:, 1] - sine * offset[:, 0]
        is_read = np.zeros(len(s), dtype=bool)
        for x, y, turn in poses:
            c, n = math.cos(turn), math.sin(turn)
            along, across = ahead - x, aside - y
            is_read |= area.contains(np.stack([c * along + n * across, c * across - n * along], axis=-1))
        found.append((s[is_read], t[is_read]))
    return np.concatenate([s for s, _ in found]), np.concatenate([t for _, t in found])
