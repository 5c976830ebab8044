"""Place the fewest tags along routes so that a robot reads one within a given distance, even with any one tag dead."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign.geometry import DetectionArea, ReaderLayout
from rfiddesign.optimize.tag_placement.choose import choose
from rfiddesign.optimize.tag_placement.drive_check import DriveCheck, drive_check
from rfiddesign.optimize.tag_placement.rules import PlacementRules
from rfiddesign.optimize.tag_placement.search import Progress
from rfiddesign.optimize.tag_placement.windows import checked_routes


@dataclass(frozen=True, eq=False)
class TagPlacement:
    """Tags along routes, how good they are and what was checked.

    Parameters
    ----------
    tags_mm : (n_tags, 2) places of the tags [mm]; those in lines come first.
    n_in_lines : how many lie in lines; 0 unless the rules ask for lines.
    lower_bound : no choice of the candidate places that serves what they serve has fewer tags.
    method : "proved" (as few as the candidate places allow), "search" (greedy, pruned and searched) or "greedy".
    n_greedy : tags after greedy choice and pruning, before the search.
    n_places, n_rows : candidate places, and windows times deviations that differ.
    n_windows, n_unserved : windows times deviations times directions of travel, and those of them that the candidate
        places cannot serve often enough, both counted before those alike were made one.
    unserved : (n, 3) x, y [mm] and robot's heading [rad] in the middle of the unserved windows, each once.
    min_cover : the fewest tags that serve any servable window, counted anew in integers.
    drive : what a drive along the routes measured.
    """

    tags_mm: NDArray[np.float64]
    n_in_lines: int
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
    on_progress : called with a step's name ("search" or "bound"), how much of it is done, and how much it has; for
        every part of a large floor anew.

    Raises
    ------
    ValueError : if routes are no polylines, no place is left for tags, the problem exceeds memory, or tags cannot be as
        far apart as `rules.min_tag_distance_mm` asks.
    """
    rules = rules or PlacementRules()
    choice = choose(routes, layout, area, rules, allowed, seed, on_progress=on_progress)
    is_proved = choice.is_proved or len(choice.tags_mm) == choice.bound
    return TagPlacement(
        tags_mm=choice.tags_mm,
        n_in_lines=choice.n_in_lines,
        lower_bound=len(choice.tags_mm) if is_proved else choice.bound,
        method="proved" if is_proved else "search" if rules.n_search_rounds else "greedy",
        n_greedy=choice.n_greedy,
        n_places=choice.n_places,
        n_rows=choice.n_rows,
        n_windows=choice.n_windows,
        n_unserved=choice.n_unserved,
        unserved=choice.unserved,
        min_cover=choice.min_cover,
        drive=drive_check(checked_routes(routes), layout, area, choice.tags_mm, rules, seed),
    )
