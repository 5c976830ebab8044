"""Tags for many robots and distances: greedy choice and search alone; bound and check follow for those that matter.

`place_tags` proves what it can and bounds the rest, which takes up to minutes.  A study places tags for every layout and
antenna of its space, most of which are never bought.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign import require
from rfiddesign.geometry import DetectionArea, ReaderLayout
from rfiddesign.optimize.tag_placement.bound import lower_bound
from rfiddesign.optimize.tag_placement.cover import Cover, cover_of, half_width, sight_of, without_dominated
from rfiddesign.optimize.tag_placement.drive_check import drive_check
from rfiddesign.optimize.tag_placement.placement import TagPlacement
from rfiddesign.optimize.tag_placement.places import tag_places
from rfiddesign.optimize.tag_placement.rules import PlacementRules
from rfiddesign.optimize.tag_placement.search import conflicts_of, greedy_choice, least_cover, searched
from rfiddesign.optimize.tag_placement.windows import checked_routes, windows_along


def choose_tags(
    routes: Sequence[NDArray], layout: ReaderLayout, area: DetectionArea, rules: PlacementRules,
    allowed: BaseGeometry | None = None, seed: int = 0,
) -> NDArray[np.float64]:  # fmt: skip
    """Return the places (n, 2) [mm] of tags that keep the rules, chosen greedily and searched; see `place_tags`."""
    choice = _choice(checked_routes(routes), layout, area, rules, allowed, seed)
    return choice.places[choice.chosen]


def assess_tags(
    routes: Sequence[NDArray], layout: ReaderLayout, area: DetectionArea, rules: PlacementRules,
    allowed: BaseGeometry | None = None, seed: int = 0,
) -> TagPlacement:  # fmt: skip
    """Return the tags that `choose_tags` chooses, with their lower bound and an independent drive over them."""
    routes = checked_routes(routes)
    choice = _choice(routes, layout, area, rules, allowed, seed)
    cover, tags = choice.cover, choice.places[choice.chosen]
    bound = lower_bound(cover, choice.places, rules.n_cover)
    return TagPlacement(
        tags_mm=tags,
        lower_bound=bound,
        method="proved" if bound == len(tags) else "search" if rules.n_search_rounds else "greedy",
        n_greedy=choice.n_greedy,
        n_places=len(choice.places),
        n_rows=cover.rows.shape[0],
        n_windows=cover.n_windows,
        n_unserved=cover.n_unserved,
        unserved=cover.unserved,
        min_cover=least_cover(cover, choice.chosen),
        drive=drive_check(routes, layout, area, tags, rules, seed),
    )


@dataclass(frozen=True, eq=False)
class _Choice:
    """Candidate places (n, 2) [mm] with the problem they pose, which of them are chosen, and how many at first."""

    cover: Cover
    places: NDArray[np.float64]
    chosen: NDArray[np.bool_]
    n_greedy: int


def _choice(
    routes: Sequence[NDArray], layout: ReaderLayout, area: DetectionArea, rules: PlacementRules,
    allowed: BaseGeometry | None, seed: int,
) -> _Choice:  # fmt: skip
    require.seed("seed", seed)
    windows = windows_along(routes, rules.delta_mm, rules.window_mm)
    sight = sight_of(layout, area, rules)
    places = tag_places(routes, half_width(sight), rules.along_mm, rules.across_mm, allowed)
    cover = cover_of(windows, places, sight, rules.n_cover)
    if rules.min_tag_distance_mm == 0:
        cover, places = without_dominated(cover, places, rules.n_cover)
    conflicts = conflicts_of(places, rules.min_tag_distance_mm)
    chosen, n_lacking = greedy_choice(cover, conflicts, rules.n_cover)
    if n_lacking:
        raise ValueError(
            f"min_tag_distance_mm = {rules.min_tag_distance_mm:g}: leaves {n_lacking} windows without a second tag"
        )
    best = searched(cover, conflicts, rules.n_cover, chosen, rules.n_search_rounds, seed)
    return _Choice(cover, places, best, int(chosen.sum()))
