"""Place the fewest tags along routes so that a robot reads one within a given distance, even with any one tag dead."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign import require
from rfiddesign.geometry import DetectionArea, ReaderLayout
from rfiddesign.optimize.tag_placement.bound import lower_bound
from rfiddesign.optimize.tag_placement.cover import Cover, cover_of, half_width, sight_of, without_dominated
from rfiddesign.optimize.tag_placement.drive_check import DriveCheck, drive_check
from rfiddesign.optimize.tag_placement.places import tag_places
from rfiddesign.optimize.tag_placement.rules import PlacementRules
from rfiddesign.optimize.tag_placement.search import (
    Progress,
    conflicts_of,
    greedy_choice,
    least_cover,
    proved,
    searched,
)
from rfiddesign.optimize.tag_placement.windows import checked_routes, windows_along


@dataclass(frozen=True, eq=False)
class TagPlacement:
    """Tags along routes, how good they are and what was checked.

    Parameters
    ----------
    tags_mm : (n_tags, 2) places of the tags [mm].
    lower_bound : no choice of the candidate places that serves what they serve has fewer tags.
    method : "proved" (as few as the candidate places allow), "search" (greedy, pruned and searched) or "greedy".
    n_greedy : tags after greedy choice and pruning, before the search.
    n_places, n_rows : candidate places, and windows times deviations that differ, in the problem that was searched.
    n_windows, n_unserved : windows times deviations times directions of travel, and those of them that the candidate
        places cannot serve often enough, both counted before those alike were made one.
    unserved : (n, 3) x, y [mm] and robot's heading [rad] in the middle of the unserved windows, each once.
    min_cover : the fewest tags that serve any servable window, counted anew in integers.
    drive : what a drive along the routes measured.
    """

    tags_mm: NDArray[np.float64]
    lower_bound: int
    method: str
    n_greedy: int
    n_places: int
    n_rows: int
    n_windows: int
    n_unserved: int
    unserved: NDArray[np.float64]
    min_cover: int
    drive: DriveCheck

    @property
    def n_tags(self) -> int:
        """Number of tags."""
        return len(self.tags_mm)

    @property
    def gap(self) -> float:
        """Share of the tags that the lower bound leaves open."""
        return 1 - self.lower_bound / self.n_tags if self.n_tags else 0.0


def place_tags(
    routes: Sequence[NDArray],
    layout: ReaderLayout,
    area: DetectionArea,
    rules: PlacementRules | None = None,
    allowed: BaseGeometry | None = None,
    seed: int = 0,
    on_progress: Progress | None = None,
) -> TagPlacement:
    """Place tags along routes.

    The answer depends on the arguments only: the search is limited by rounds, not by time.

    Parameters
    ----------
    routes : polylines (k, 2) [mm], each driven in both directions; those that end at one point are joined there.
    layout, area : the robot's antennas and what each of them sees of the floor.
    allowed : region in which tags may lie; everywhere if None.
    seed : of the search and of the drives' deviations.
    on_progress : called with a step's name ("bound" or "search"), how much of it is done, and how much it has.

    Raises
    ------
    ValueError : if routes are no polylines, no place is left for tags, the problem exceeds memory, or tags cannot be as
        far apart as `rules.min_tag_distance_mm` asks.
    """
    rules, seed = rules or PlacementRules(), require.seed("seed", seed)
    routes = checked_routes(routes)
    windows = windows_along(routes, rules.delta_mm, rules.window_mm)
    sight = sight_of(layout, area, rules)
    places = tag_places(routes, half_width(sight), rules.along_mm, rules.across_mm, allowed)
    cover = cover_of(windows, places, sight, rules.n_cover)
    if rules.min_tag_distance_mm == 0:
        cover, places = without_dominated(cover, places, rules.n_cover)
    chosen, n_greedy, bound, method = _choose(cover, places, rules, seed, on_progress)
    tags = places[chosen]
    return TagPlacement(
        tags_mm=tags,
        lower_bound=bound,
        method=method,
        n_greedy=n_greedy,
        n_places=len(places),
        n_rows=cover.rows.shape[0],
        n_windows=cover.n_windows,
        n_unserved=cover.n_unserved,
        unserved=cover.unserved,
        min_cover=least_cover(cover, chosen),
        drive=drive_check(routes, layout, area, tags, rules, seed),
    )


def _choose(
    cover: Cover, places: NDArray, rules: PlacementRules, seed: int, on_progress: Progress | None
) -> tuple[NDArray[np.bool_], int, int, str]:
    """Return the choice, the size of the greedy one, the lower bound and the method."""
    conflicts = conflicts_of(places, rules.min_tag_distance_mm)
    chosen, n_lacking = greedy_choice(cover, conflicts, rules.n_cover)
    if n_lacking:
        raise ValueError(
            f"min_tag_distance_mm = {rules.min_tag_distance_mm:g}: leaves {n_lacking} windows without a second tag"
        )
    n_greedy = int(chosen.sum())
    best = proved(cover, conflicts, rules.n_cover)
    if best is not None and least_cover(cover, best) >= rules.n_cover:
        return best, n_greedy, int(best.sum()), "proved"
    bound = lower_bound(cover, places, rules.n_cover, on_progress)
    chosen = searched(cover, conflicts, rules.n_cover, chosen, rules.n_search_rounds, seed, on_progress)
    if chosen.sum() == bound:
        return chosen, n_greedy, bound, "proved"
    return chosen, n_greedy, bound, "search" if rules.n_search_rounds else "greedy"
