"""The cheapest certified design of every fleet and floor of a map, from one set of runs.

Whether a drive passes depends on the design and on the floor that was simulated, the reference floor; neither on the
size of the fleet nor on how much floor of the same kind there is.  So the cells of the map differ in prices alone, and
run i of a design serves all of them: dozens of cells cost little more than the few that differ.  A cell's floor takes
the reference floor's tags per m2 times its area, rounded to whole tags; its plan is not drawn and not simulated.

What may be said of all cells at once
-------------------------------------
With p, p0, p1 and N as in :mod:`rfiddesign.optimize.certify`, K cells, and the prices known before the first run:

1. *Every winner of every cell has p > p1*, but for a chance of at most alpha_certify in all.  Certification is a
   statement about the runs of a design, wherever it wins, and alpha_certify is divided by the N designs already.  It
   pays for any number of cells, the study's own fleets included.
2. *In one cell, nothing cheaper than its lower bound has p >= p0*, but for a chance of at most alpha_refute: the
   statement of :mod:`rfiddesign.optimize.cheapest`, cell by cell.  By linearity of the mean, the expected share of
   cells where it is wrong is at most alpha_refute too, however the cells depend on each other.
3. *In all cells at once*: the statement fails somewhere only if some cell's cheapest holding design was refuted.  The
   truth fixes those designs, not the data; if there are at most u different ones, the chance is at most u alpha_refute
   (union bound over them).  u <= K is always true and often poor.  Prices bound it better.  But for rounding, a cell
   of n robots on A m2 costs

       P + n R_d + A T_d = P + A (rho R_d + T_d),    rho = n / A,

   with R_d for the design's hardware on one robot, T_d for what it lays on one m2, and P for the project: cells of one
   mix rho have one order of prices, hence one cheapest holding design h_rho, and u is at most the number m of
   different mixes.  (A map spaced evenly in logarithms by one factor has as many mixes as diagonals.)  Rounding shifts
   a price by at most delta = half a tag, half a hundredth of a m2 and half a cent for each line.  As long as h_rho is
   not refuted, the lower bound in a cell of that mix costs at most price(h_rho) <= rho-price(h_rho) + delta <=
   rho-price(h) + delta <= price(h) + 2 delta for whatever h holds.  So *no design that holds is cheaper than its cell's
   lower bound by more than 2 delta, in all cells at once, but for a chance of at most m alpha_refute*.  Declare
   alpha_refute = alpha / m to have that at alpha.
4. 1 and 3 together: at most alpha_certify + m alpha_refute.

Not promised: that a boundary drawn between two winners is where the truth changes sides (a design that was never
tested, or refuted below p1 < p < p0, may lie between them); anything about floors that are unlike the reference floor.

Where boundaries lie
--------------------
Two designs a, b with R_a > R_b and T_a < T_b cost the same where rho = (T_b - T_a) / (R_a - R_b).  With every m2
tagged, covering, survey and project cancel: a boundary moves in proportion to the price of a laid tag and against that
of an equipped antenna, and by nothing else.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from math import ceil

import numpy as np
from numpy.typing import NDArray

from rfiddesign.cost import Cost, PriceList, Site
from rfiddesign.floor import Floor
from rfiddesign.optimize import Progress, SearchResult, cheapest_certified
from rfiddesign.study.candidates import Candidate, Candidates
from rfiddesign.study.load import Study
from rfiddesign.study.outcomes import StoredOutcomes, StoredRuns
from rfiddesign.study.pipeline import price_design, search_rules, test_plan
from rfiddesign.study.stages import OnStage, Stage
from rfiddesign.units import CENTS_PER_UNIT

PER_ROBOT, PER_TAG, PER_M2, PER_PROJECT = "per robot", "per tag", "per m2", "per project"


@dataclass(frozen=True, eq=False)
class CellAnswer:
    """What the search found in one cell; its indices point into `Candidates.numbers`, `cents` has a price for each."""

    site: Site
    cents: NDArray[np.int64]
    search: SearchResult


def search_regimes(
    study: Study, candidates: Candidates, floor: Floor, runs: StoredRuns, on_stage: OnStage
) -> tuple[CellAnswer, ...]:
    """Search every cell of the study's map; none if it asks for no map."""
    section = study.file.regimes
    if section is None:
        return ()
    plan = test_plan(study, len(candidates.numbers))
    rules = search_rules(study, candidates, plan)
    outcomes = StoredOutcomes(runs, list(candidates.numbers), study.criteria)
    sites = [Site(n_robots, area_m2) for area_m2 in section.areas_m2 for n_robots in section.robots]
    found = []
    for i, site in enumerate(sites, start=1):
        told = f"cell {i} of {len(sites)}: {site.n_robots:,} robots on {site.area_m2:,g} m2"

        def show(progress: Progress, told: str = told) -> None:
            on_stage(Stage(told, progress.n_refuted, progress.n_racing, progress.n_remaining, progress.n_runs))

        cents = cell_cents(study, candidates, floor, site)
        search = cheapest_certified(cents, outcomes, plan, rules=rules, on_progress=show)
        found.append(CellAnswer(site, cents, search))
        runs.drop_ahead()
    return tuple(found)


def cell_cents(study: Study, candidates: Candidates, floor: Floor, site: Site) -> NDArray[np.int64]:
    """Exact price of every candidate on the floor of a cell [cents], in the order of `candidates.numbers`.

    The lines that count robots depend on the hardware alone, the others on tags and area alone, so that each half is
    priced once for all designs that share it.
    """
    robots_half: dict[tuple, int] = {}
    floor_half: dict[tuple, int] = {}
    cents = np.empty(len(candidates.numbers), np.int64)
    for i, candidate in enumerate(candidates.by_number.values()):
        design, bill = candidate.design, cell_bill(candidate, floor, site)
        hardware = (design.layout, design.antenna, design.reader)
        if hardware not in robots_half or bill not in floor_half:
            groups = by_group(price_design(study, design, *bill))
            robots_half[hardware] = groups.pop(PER_ROBOT)
            floor_half[bill] = sum(groups.values())
        cents[i] = robots_half[hardware] + floor_half[bill]
    return cents


def cell_bill(candidate: Candidate, floor: Floor, site: Site) -> tuple[int, Site]:
    """Tags and covered floor of a candidate in a cell: as much of both per m2 as on the reference floor."""
    factor = site.area_m2 / floor.area_m2
    return round(factor * candidate.n_tags), Site(site.n_robots, round(factor * candidate.tagged_m2, 2))


def by_group(price: Cost) -> dict[str, int]:
    """Cents of a price by group of its lines."""
    groups = dict.fromkeys((PER_ROBOT, PER_TAG, PER_M2, PER_PROJECT), 0)
    for line in price.lines:
        groups[line.group] += line.amount_cents
    return groups


def mix(site: Site) -> Fraction:
    """Robots per m2, exactly; areas count in hundredths of a m2, as in prices."""
    return Fraction(100 * site.n_robots, round(100 * site.area_m2))


def n_mixes(sites: Iterable[Site]) -> int:
    """How many different ratios of robots to area there are."""
    return len({mix(site) for site in sites})


def tolerance_cents(prices: PriceList) -> int:
    """What rounding can move the difference of two prices by.

    Each is off by half a tag, half a hundredth of a m2 and half a cent for each line; a bill has a line for each kind
    of controller at most and eight others.
    """
    laid_tag = prices.tag.amount + prices.tag_laying.amount
    covered_m2 = prices.covering_per_m2.amount + prices.survey_per_m2.amount
    return ceil(CENTS_PER_UNIT * (laid_tag + covered_m2 / 100) + 8 + len(prices.controllers))
