"""What a placement of tags along routes must guarantee, and how long it is searched."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rfiddesign import require

MAX_SPARE, MAX_STEPS, MAX_ROUNDS = 9, 51, 10**10


@dataclass(frozen=True)
class PlacementRules:
    """A robot that follows a route, a little beside it and a little turned, reads a tag within a given distance.

    Parameters
    ----------
    distance_mm : a read comes within this driven distance [mm], wherever on the routes it is begun.
    delta_mm : windows of travel, `distance_mm` - `delta_mm` long, begin every `delta_mm` [mm]. Each stretch of
        `distance_mm` then holds a whole window, so that serving the windows serves all stretches.
    n_spare : every window stays served when any so many tags are dead: it is served by 1 + `n_spare` different tags.
    lateral_mm, n_laterals : the robot's centre is beside the route by up to this [mm] to either side, at so many evenly
        spaced places.
    yaw_rad, n_yaws : the same of its heading against the route [rad].
        What lies between the deviations is not promised, and a search finds the places that only just serve the listed
        ones: on the Willow map a cross of eight with discs of 30 mm and 3 laterals drove 4 to 9 % of the way farther
        than `distance_mm` after a read, at random deviations; with 5 laterals, and 22 % more tags, 0.02 %.
    headings_rad : headings of the robot against its direction of travel [rad]: 0 faces the way, pi / 2 drives to its
        right. Routes are driven in both directions.
    margin_mm : a tag counts as seen only so deep within an antenna's area [mm]. It takes up the tags' installation
        error, and what lies between the deviations if it is at least half their step.
    along_mm, across_mm : the grid of candidate tag places, along and across a route [mm].
    min_tag_distance_mm : no two tags are closer than this [mm].
    is_in_lines : whether tags lie in lines that an installer can lay, see `lines`.
    n_search_rounds : length of the search: how many times a tag is moved. Where eight small antennas see a tag some
        10,000 take a second.
    is_proved : whether HiGHS tries to prove small problems first, which may take minutes.
    """

    distance_mm: float = 500.0
    delta_mm: float = 50.0
    n_spare: int = 1
    lateral_mm: float = 50.0
    n_laterals: int = 3
    yaw_rad: float = math.radians(3.0)
    n_yaws: int = 3
    headings_rad: tuple[float, ...] = (0.0,)
    margin_mm: float = 1.0
    along_mm: float = 50.0
    across_mm: float = 25.0
    min_tag_distance_mm: float = 0.0
    is_in_lines: bool = False
    n_search_rounds: int = 500_000
    is_proved: bool = True

    def __post_init__(self):
        for argument in ("distance_mm", "delta_mm", "along_mm", "across_mm"):
            require.positive(argument, getattr(self, argument))
        for argument in ("lateral_mm", "yaw_rad", "margin_mm", "min_tag_distance_mm"):
            require.not_negative(argument, getattr(self, argument))
        if self.delta_mm >= self.distance_mm:
            raise ValueError(f"delta_mm = {self.delta_mm:g}: must be below distance_mm = {self.distance_mm:g}")
        if not 0 <= self.n_spare <= MAX_SPARE:
            raise ValueError(f"n_spare = {self.n_spare!r}: must be a whole number from 0 to {MAX_SPARE}")
        for argument in ("n_laterals", "n_yaws"):
            require.count(argument, getattr(self, argument), at_most=MAX_STEPS)
        if not 0 <= self.n_search_rounds <= MAX_ROUNDS:
            raise ValueError(f"n_search_rounds = {self.n_search_rounds!r}: must be a whole number from 0 to 10^10")
        if not self.headings_rad:
            raise ValueError("headings_rad is empty: must hold at least one heading")
        for heading in self.headings_rad:
            require.finite("headings_rad", heading)

    @property
    def window_mm(self) -> float:
        """Length of a window of travel [mm]."""
        return self.distance_mm - self.delta_mm

    @property
    def n_cover(self) -> int:
        """How many different tags serve a window."""
        return 1 + self.n_spare

    @property
    def laterals_mm(self) -> NDArray[np.float64]:
        """Places (n_laterals,) beside the route [mm]."""
        return _steps(self.lateral_mm, self.n_laterals)

    @property
    def yaws_rad(self) -> NDArray[np.float64]:
        """Headings (n_yaws,) against the route [rad]."""
        return _steps(self.yaw_rad, self.n_yaws)


def _steps(half_width: float, n: int) -> NDArray[np.float64]:
    return np.linspace(-half_width, half_width, n) if n > 1 else np.zeros(1)
