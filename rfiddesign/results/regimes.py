"""The cheapest certified design over fleets and floors: what `regimes.json` holds, and its map is drawn from.

As in `result.json` nothing here depends on when, where or with how many workers the study ran.
"""

from typing import Literal

from pydantic import Field

from rfiddesign.results.study_result import Record


class RegimeDesign(Record):
    """A design that wins or bounds a cell, with what it costs.

    `per_robot` and `per_m2` are exact to the rounding of a line of a bill: amounts in the currency for each robot (its
    readers, antennas, controllers and cabling) and for each m2 of floor (its tags, laid).
    """

    number: int
    name: str
    layout: str
    antenna: str
    pattern: str
    tags_per_m2: float
    n_readers: int
    estimator: str | None
    per_robot: float
    per_m2: float


class RegimeCell(Record):
    """The answer for one fleet on one floor.

    `winner` and `lower_bound` are numbers of designs; `n_passed` of `n_runs` are the winner's.  The price is the sum
    of what goes with the robots, with the tags, with the area and with the project.  `n_undecided` designs cheaper than
    the winner came to no verdict.  `n_runs_used` counts the runs that this cell alone would have needed.
    """

    n_robots: int
    area_m2: float
    claim: str
    winner: int | None
    lower_bound: int | None
    lower_bound_cents: int | None
    n_undecided: int
    n_runs: int
    n_passed: int
    n_tags: int
    cost_cents: int
    robots_cents: int
    tags_cents: int
    area_cents: int
    project_cents: int
    n_runs_used: int

    @property
    def robots_per_1000_m2(self) -> float:
        """How densely the floor is used."""
        return 1000.0 * self.n_robots / self.area_m2


class RegimeBoundary(Record):
    """Where the prices of two winners are equal: below this many robots per 1,000 m2 `below` costs less."""

    below: int
    above: int
    robots_per_1000_m2: float


class Regimes(Record):
    """The map.

    `n_mixes` distinct ratios of robots to area are among the cells; `tolerance_cents` is what rounding to whole tags
    and cents can move a comparison of two prices by.  What both are for: :mod:`rfiddesign.study.regimes`.
    `n_runs` runs decided all cells together.
    """

    format: Literal[1] = 1
    version: str
    study_hash: str
    currency: str
    reference_floor: str
    reference_area_m2: float
    hold_probability: float
    fail_probability: float
    alpha_refute: float
    alpha_certify: float
    n_designs: int
    n_mixes: int
    tolerance_cents: int
    n_runs: int
    cells: list[RegimeCell] = Field(min_length=1)
    designs: list[RegimeDesign]
    boundaries: list[RegimeBoundary]

    @property
    def fleets(self) -> list[int]:
        """Sizes of fleets, rising."""
        return sorted({cell.n_robots for cell in self.cells})

    @property
    def areas_m2(self) -> list[float]:
        """Areas, rising."""
        return sorted({cell.area_m2 for cell in self.cells})

    def design(self, number: int) -> RegimeDesign:
        """The design of that number."""
        return next(design for design in self.designs if design.number == number)

    def cell(self, n_robots: int, area_m2: float) -> RegimeCell:
        """The cell of a fleet and a floor."""
        return next(cell for cell in self.cells if (cell.n_robots, cell.area_m2) == (n_robots, area_m2))
