"""Which candidate places get a tag: the whole floor at once if it is small, else part by part."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from rfiddesign import require
from rfiddesign.geometry import DetectionArea, ReaderLayout
from rfiddesign.optimize.tag_placement.bound import WEIGHT_UNIT, Proof, row_weights
from rfiddesign.optimize.tag_placement.cover import (
    Sight,
    cover_of,
    half_width,
    left_to_serve,
    sight_of,
    with_places,
    without_dominated,
)
from rfiddesign.optimize.tag_placement.lines import line_tags
from rfiddesign.optimize.tag_placement.places import tag_places
from rfiddesign.optimize.tag_placement.rules import PlacementRules
from rfiddesign.optimize.tag_placement.search import (
    Progress,
    conflicts_of,
    counts_of,
    greedy_choice,
    proved,
    searched,
)
from rfiddesign.optimize.tag_placement.windows import Windows, checked_routes, parts, windows_along

#: Windows of a part at most: 500 m of routes, and about 1 GB where eight small antennas see a tag.
PART_WINDOWS = 12_000
#: Places in a leaf of the tree of all places: it then takes half of their own memory, and looking up takes no longer.
LEAF = 64


@dataclass(frozen=True, eq=False)
class Choice:
    """Chosen places of tags and the problem they solve.

    Parameters
    ----------
    tags_mm : (n, 2) [mm]; those in lines come first.
    n_in_lines, n_greedy : tags that lie in lines; tags before the search.
    bound : of the number of tags, 0 if it was not asked for.
    is_proved : whether no fewer of the candidate places suffice.
    n_places, n_rows, n_windows, n_unserved, unserved, min_cover : as in `placement.TagPlacement`.
    """

    tags_mm: NDArray[np.float64]
    n_in_lines: int
    n_greedy: int
    bound: int
    is_proved: bool
    n_places: int
    n_rows: int
    n_windows: int
    n_unserved: int
    unserved: NDArray[np.float64]
    min_cover: int


@dataclass(eq=False)
class _Floor:
    """All candidate places, which of them have a tag by now, and the proof so far."""

    places: cKDTree
    is_laid: NDArray[np.bool_]
    proof: Proof


@dataclass(frozen=True, eq=False)
class _Part:
    """What is kept of a part: counts as in `Choice`, the tags that the search saved, and the fewest tags of a row.

    Its rows are not kept: those of one part take as much memory as all the rest.
    """

    n_rows: int
    n_windows: int
    n_unserved: int
    unserved: NDArray[np.float64]
    n_saved: int
    is_proved: bool
    min_cover: int


def choose_tags(
    routes: Sequence[NDArray], layout: ReaderLayout, area: DetectionArea, rules: PlacementRules,
    allowed: BaseGeometry | None, seed: int,
) -> NDArray[np.float64]:  # fmt: skip
    """Return the places (n, 2) [mm] of the tags that `place_tags` lays for the same arguments.

    It leaves out the lower bound and the check, which take much of the time.
    """
    return choose(routes, layout, area, rules, allowed, seed, is_bounded=False).tags_mm


def choose(
    routes: Sequence[NDArray], layout: ReaderLayout, area: DetectionArea, rules: PlacementRules,
    allowed: BaseGeometry | None, seed: int, *, is_bounded: bool = True, on_progress: Progress | None = None,
) -> Choice:  # fmt: skip
    """Choose the places of tags; arguments and errors as in `place_tags`.

    A part of the floor finds the tags of the parts before it laid. The bound holds for all parts together.
    """
    seed, routes = require.seed("seed", seed), checked_routes(routes)
    windows, sight = windows_along(routes, rules.delta_mm, rules.window_mm), sight_of(layout, area, rules)
    places = tag_places(routes, half_width(sight), rules.along_mm, rules.across_mm, allowed)
    in_lines = line_tags(routes, sight, rules, allowed) if rules.is_in_lines else places[:0]
    places = np.concatenate([in_lines, places])
    floor = _Floor(
        cKDTree(places, leafsize=LEAF),
        np.arange(len(places)) < len(in_lines),
        Proof(0, np.zeros(len(places), np.int64)),
    )
    solved = []
    for part in parts(windows, PART_WINDOWS):
        rounds = round(rules.n_search_rounds * part.n_windows / windows.n_windows)
        solved.append(_solve(part, floor, sight, replace(rules, n_search_rounds=rounds), seed, is_bounded, on_progress))
    tags = np.concatenate([in_lines, places[len(in_lines) :][floor.is_laid[len(in_lines) :]]])
    return Choice(
        tags_mm=tags,
        n_in_lines=len(in_lines),
        n_greedy=len(tags) + sum(part.n_saved for part in solved),
        bound=floor.proof.bound if is_bounded else 0,
        is_proved=len(solved) == 1 and solved[0].is_proved and not len(in_lines),
        n_places=len(places) - len(in_lines),
        n_rows=sum(part.n_rows for part in solved),
        n_windows=sum(part.n_windows for part in solved),
        n_unserved=sum(part.n_unserved for part in solved),
        unserved=np.concatenate([np.empty((0, 3)), *(part.unserved for part in solved)]),
        min_cover=min((part.min_cover for part in solved if part.n_rows), default=0),
    )


def _solve(
    windows: Windows, floor: _Floor, sight: Sight, rules: PlacementRules, seed: int, is_bounded: bool,
    on_progress: Progress | None,
) -> _Part:  # fmt: skip
    """Lay the tags that one part of the windows needs beside those laid already, and add its share to the proof."""
    whole = cover_of(windows, floor.places, sight, rules.n_cover)
    is_free = rules.min_tag_distance_mm == 0
    cover = left_to_serve(whole, floor.is_laid[whole.number])
    if is_free:
        cover = without_dominated(cover)
    else:
        cover = with_places(cover, _is_apart(floor, cover.number, rules.min_tag_distance_mm))
    places = floor.places.data[cover.number]
    conflicts = conflicts_of(places, rules.min_tag_distance_mm)
    chosen, n_lacking = greedy_choice(cover, conflicts)
    if n_lacking:
        raise ValueError(
            f"min_tag_distance_mm = {rules.min_tag_distance_mm:g}: leaves {n_lacking} windows without a tag they need"
        )
    n_greedy = int(chosen.sum())
    fewest = proved(cover, conflicts) if rules.is_proved else None
    if fewest is None:
        chosen = searched(cover, conflicts, chosen, rules.n_search_rounds, seed, on_progress)
    is_proved = fewest is not None
    chosen = fewest if is_proved else chosen
    floor.is_laid[cover.number[chosen]] = True
    if is_bounded:
        # A place that others dominate carries no more load than they do, but for what other parts load on it.
        bounded = without_dominated(whole, floor.proof.loads[whole.number] > 0)
        loads = floor.proof.loads[bounded.number] / WEIGHT_UNIT
        floor.proof.add(whole, row_weights(bounded, floor.places.data[bounded.number], loads, on_progress))
    counts = counts_of(whole, floor.is_laid[whole.number])
    return _Part(
        whole.rows.shape[0], whole.n_windows, whole.n_unserved, whole.unserved,
        n_greedy - int(chosen.sum()), is_proved, int(counts.min(initial=rules.n_cover)),
    )  # fmt: skip


def _is_apart(floor: _Floor, number: NDArray, distance: float) -> NDArray[np.bool_]:
    """Which of the places are not closer than `distance` to a tag that is laid."""
    laid = floor.places.data[floor.is_laid]
    if len(laid) == 0:
        return np.ones(len(number), dtype=bool)
    nearest, _ = cKDTree(laid).query(floor.places.data[number])
    return nearest >= distance * (1 - 1e-9)
