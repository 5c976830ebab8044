"""Assumptions that save runs: "this design holds only if that one does".

A study may declare, before the first run, that a design is never better than another: the same with some of its
antennas left out, or with fewer tags of the same pattern.  Where the stronger one is refuted the weaker need not be
tried.  Nothing proves such a thing (a square lattice of 90 mm may do where one of 80 mm aliases with the antennas), so
that what was left out by assumption is reported apart from what was refuted.

Chance of error.  Let D be the cheapest design that holds.  If the assumptions are true, every design assumed to be no
weaker than D holds, too, and D is counted out wrongly only if one of those was refuted.  They may be many, and which of
them is tested depends on the runs: so a refutation counts for weaker designs only at M times the evidence, M being the
most designs that stand above any one.  By the union bound that adds at most `alpha_refute` to the chance that a claim
of "nothing cheaper holds" is wrong.
"""

from collections import Counter
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from rfiddesign.design import Design
from rfiddesign.geometry import ListedPattern, PlacedPattern
from rfiddesign.optimize.certify import TestPlan
from rfiddesign.optimize.judge import Battery, battery

Assumption = Literal["fewer antennas", "fewer tags"]

ASSUMPTIONS: dict[Assumption, str] = {
    "fewer antennas": "a robot does no better with some of its antennas left out",
    "fewer tags": "the same pattern does no better with fewer tags per square metre",
}
# Antennas closer than this [mm] are the same one.
_SAME_MM = 0.01


@dataclass(frozen=True, eq=False)
class Weaker:
    """Which designs are assumed to be no better than each, and the tests with the evidence that this takes.

    `refute_threshold` is that evidence, for one criterion.
    """

    than: tuple[tuple[int, ...], ...]
    tests: Battery
    refute_threshold: float


def weaker_designs(
    designs: Sequence[Design], others: Sequence[Hashable], assumptions: Sequence[Assumption], plan: TestPlan
) -> Weaker | None:
    """What the assumptions say of some designs; None if that is nothing.

    Several assumptions also hold one after the other: fewer antennas and fewer tags.

    Parameters
    ----------
    designs : the designs.
    others : what else a candidate consists of, such as its estimator; only those that have it in common are compared.
    assumptions : what is assumed.
    plan : the test as declared.

    Raises
    ------
    ValueError : for an unknown assumption.
    """
    for assumption in assumptions:
        if assumption not in ASSUMPTIONS:
            raise ValueError(f"assumption is {assumption!r}, must be one of {', '.join(ASSUMPTIONS)}")
    groups: dict[Hashable, list[int]] = {}
    for i, (design, other) in enumerate(zip(designs, others, strict=True)):
        # Tags at places of their own, listed or chosen for a layout, have no density that could be lowered.
        if not isinstance(design.pattern, ListedPattern | PlacedPattern):
            key = (design.antenna, design.reader.name, design.pattern.name, other)
            groups.setdefault(key, []).append(i)
    antennas = [_antennas(design) for design in designs]
    density = [design.pattern.tags_per_m2 for design in designs]

    def is_weaker(i: int, j: int) -> bool:
        is_fewer, is_sparser = antennas[i] < antennas[j], density[i] < density[j]
        return (
            (is_fewer or is_sparser)
            and (antennas[i] == antennas[j] or (is_fewer and "fewer antennas" in assumptions))
            and (density[i] == density[j] or (is_sparser and "fewer tags" in assumptions))
        )

    than: list[tuple[int, ...]] = [()] * len(designs)
    for members in groups.values():
        for j in members:
            than[j] = tuple(i for i in members if is_weaker(i, j))
    n_above = max(Counter(i for named in than for i in named).values(), default=0)
    if not n_above:
        return None
    strict = replace(plan, alpha_refute=plan.alpha_refute / n_above)
    return Weaker(tuple(than), battery(strict), strict.refute_threshold)


def _antennas(design: Design) -> frozenset[tuple[int, int, int]]:
    """Places of the antennas, such that those that differ by rounding are the same."""
    return frozenset((round(x / _SAME_MM), round(y / _SAME_MM), round(yaw, 4)) for x, y, yaw in design.layout.poses)
