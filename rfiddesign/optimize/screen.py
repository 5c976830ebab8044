"""Screens: designs that are not even tried, by a rule declared before the first run.

A screen cuts work, not error: what it removes was never tested, so that every claim is about the designs it left.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from rfiddesign.design import Design
from rfiddesign.geometry import coverage, single


@dataclass(frozen=True)
class Screen:
    """A declared screen and what it removed.

    Parameters
    ----------
    rule : the rule in words.
    kind : "heuristic" (experience says so) or "proof" (no removed design can hold).
    n_removed : how many designs it removed.
    """

    rule: str
    kind: str
    n_removed: int


def expected_reads(designs: tuple[Design, ...], mapped: Callable[..., Iterable] = map) -> np.ndarray:
    """Expected reads per poll of all readers of each design, over lattice phases and headings, shape (n,).

    A mean does not ask how readers depend on each other: it is the number of readers times one reader's.  `mapped` is
    `map`, or one that uses several cores.
    """
    one = single()
    views = list(dict.fromkeys((design.antenna.area, design.pattern) for design in designs))
    found = mapped(lambda view: coverage(one, *view).expected_reads, views)
    per_reader = dict(zip(views, found, strict=True))
    return np.array([d.layout.n_readers * per_reader[d.antenna.area, d.pattern] for d in designs])


def screen_by_reads(reads: np.ndarray, minimum: float) -> tuple[np.ndarray, Screen]:
    """Which designs (bool, (n,)) expect at least `minimum` reads per poll, and the screen as declared."""
    is_kept = reads >= minimum
    rule = f"fewer than {minimum:g} expected reads per poll of all readers"
    return is_kept, Screen(rule, "heuristic", int(np.count_nonzero(~is_kept)))
