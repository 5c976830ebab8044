"""Landscapes that searches are compared on: 3,000 designs with exact prices and known pass probabilities.

What is right can be told only where the truth is known.  So the truth is made, but from a real study: `passed-*.csv`
(written by `measure.py`) say how many of 12 or 48 drives of the willow-office scenario each of 3,000 designs passed.
A logistic model in readers, antenna, density and pattern is fitted to it, smooth and nearly monotone, and each design's
own drives pull it off that surface as far as they weigh: p = (passed + w m) / (runs + w), m being the model's share.
This is the mean of a beta distribution around m given the drives, and w is what makes the drives of all designs most
likely: the model is worth as much as it proves to be.  Thus designs that fail between neighbours that pass (pitch
aliases with the layout) stay in the landscape.  Nothing here claims that a design of the real study has exactly this p.
"""

import csv
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.special import betaln

from rfiddesign.cost import Site, cost
from rfiddesign.design import Design
from rfiddesign.optimize import TestPlan
from tests.benchmarks.search.measure import DENSITIES, listed, passed_path

RIDGE = 1e-3
N_NEWTON = 50
#: The fleets of willow-office, their geometric mean, and its floor [m2].
FLEETS, AREA_M2 = (5, 32, 200), 1272.0
LISTS = tuple(DENSITIES)


@dataclass(frozen=True, eq=False)
class Landscape:
    """Designs (n,) at the prices of one fleet.

    Parameters
    ----------
    name : the list of designs and the fleet, in words.
    cost_cents : exact prices.
    pass_probability : the truth, which no search sees.
    designs : (layout, antenna, pattern, density) of each.
    """

    name: str
    cost_cents: NDArray[np.int64]
    pass_probability: NDArray[np.float64]
    designs: tuple[tuple[str, str, str, float], ...]

    @property
    def plan(self) -> TestPlan:
        """The test of a study: p0 = 0.95, p1 = 0.90, 2.5 % each."""
        return TestPlan(n_designs=len(self.designs), max_runs=2000)

    @property
    def right(self) -> NDArray[np.bool_]:
        """Which designs are right answers: p > p1, and nothing cheaper has p >= p0."""
        p, plan = self.pass_probability, self.plan
        dearest = self.cost_cents[p >= plan.hold_probability].min()
        return (p > plan.fail_probability) & (self.cost_cents <= dearest)


def landscapes(which: str) -> list[Landscape]:
    """The landscapes of a list of designs, one for each fleet; they share their pass probabilities."""
    study, designs = listed(which)
    with passed_path(which).open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    names = tuple((row["layout"], row["antenna"], row["pattern"], float(row["tags_per_m2"])) for row in rows)
    assert names == tuple(map(_name, designs)), f"passed-{which}.csv is of other designs"
    n_runs, n_passed = (np.array([int(row[key]) for row in rows], float) for key in ("runs", "passed"))
    model = modelled(designs, n_runs, n_passed)
    weight = model_weight(model, n_runs, n_passed)
    p = (n_passed + weight * model) / (n_runs + weight)
    found = []
    for n_robots in FLEETS:
        cents = [_cents(design, Site(n_robots, AREA_M2), study.prices) for design in designs]
        found.append(Landscape(f"{which}, {n_robots} robots", np.array(cents, np.int64), p, names))
    return found


def model_weight(model: NDArray, n_runs: NDArray, n_passed: NDArray) -> float:
    """Drives that the model's word is worth beside a design's own: the maximum of the beta-binomial likelihood."""

    def unlikeliness(log_weight: float) -> float:
        a, b = np.exp(log_weight) * model, np.exp(log_weight) * (1.0 - model)
        return -float(np.sum(betaln(n_passed + a, n_runs - n_passed + b) - betaln(a, b)))

    return float(np.exp(minimize_scalar(unlikeliness, bounds=(-1.0, 7.0), method="bounded").x))


def _name(design: Design) -> tuple[str, str, str, float]:
    pattern = design.pattern
    return (design.layout.name, design.antenna.name, pattern.name, float(f"{pattern.tags_per_m2:g}"))


def _cents(design: Design, site: Site, prices) -> int:
    return cost(design, round(design.pattern.tags_per_m2 * site.area_m2), site, prices).total_cents


def modelled(designs: list[Design], n_runs: NDArray, n_passed: NDArray) -> NDArray[np.float64]:
    """Share of drives passed by a logistic model, quadratic in the logarithms of what one buys more or less of."""
    bought = np.log(
        [(d.layout.n_readers, d.antenna.area.area_mm2, d.pattern.tags_per_m2) for d in designs]
    )  # fmt: skip
    z = (bought - bought.mean(axis=0)) / bought.std(axis=0)
    products = [z[:, i] * z[:, j] for i in range(3) for j in range(i, 3)]
    kinds = [np.array([d.pattern.name == kind for d in designs], float) for kind in ("triangular", "random")]
    x = np.column_stack([np.ones(len(z)), z, *products, *kinds])
    weights = np.zeros(x.shape[1])
    for _ in range(N_NEWTON):
        share = 1.0 / (1.0 + np.exp(-x @ weights))
        gradient = x.T @ (n_passed - n_runs * share) - RIDGE * weights
        curvature = (x.T * (n_runs * share * (1.0 - share))) @ x + RIDGE * np.eye(len(weights))
        weights = weights + np.linalg.solve(curvature, gradient)
    return np.clip(1.0 / (1.0 + np.exp(-x @ weights)), 1e-6, 1.0 - 1e-6)
