"""The comparison of searches as a page."""

import datetime
import importlib.metadata

from tests.benchmarks.search.contenders import N_FIXED, RANDOM_RUNS, SHARES, TPE_RUNS
from tests.benchmarks.search.landscape import AREA_M2, FLEETS
from tests.benchmarks.search.measure import N_FIRST, N_FURTHER, N_PROMISING
from tests.benchmarks.search.scores import Score, table


def page(rows: list[Score], day: datetime.date) -> str:
    """The page docs/benchmarks/search.md."""
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("optuna", "numpy"))
    return f"""# Certified search against exhaustive, TPE and random search

Counted by `pytest tests/benchmarks/search --save-table docs/benchmarks` on {day} ({versions}). Runs are counted, not
timed: every machine gets this table.

{table(rows)}

- **Landscapes.** 3,000 designs (50 pairs of layout and antenna, 3 patterns, 20 densities) with exact prices from
  `studies/willow-office/prices.toml` for {", ".join(map(str, FLEETS))} robots on {AREA_M2:,.0f} m2, and known pass
  probabilities. These come from drives of the willow-office scenario: each design was driven {N_FIRST} times, and
  {N_FIRST + N_FURTHER} times if it passed {N_PROMISING} of those (`tests/benchmarks/search/passed-*.csv`, written by
  `measure.py`). A logistic model in readers, antenna area, density and pattern is fitted to that; beside a design's own
  drives it counts as many as make the drives of all designs most likely (about twenty). Designs that alias with their
  lattice and fail between neighbours that pass stay in. The list "even" has densities evenly spaced in their logarithm
  from 4 to 400 tags/m2; "crowded" has most of its densities where designs begin to hold, up to 225 tags/m2, and was
  searched by the certified search alone.
- **The bar on runs**, 1 % of exhaustive, is met on "even" and missed by two fleets of three on "crowded", where more
  designs below the answer come close to p0. Each of those takes hundreds of runs: 9 to 34 refute a design that passes
  60 to 80 %, some 220 one that passes 90 %. Real landscapes have the more of them the more a list crowds densities
  there.
- **Right** is a returned design with p > p1 = 0.90 and no cheaper design with p >= p0 = 0.95: what the certified search
  claims. Such a design may have p below p0 (it then lies in the indifference zone and is cheaper than the cheapest that
  holds), hence the column "below p0"; only designs at or below p1 are sold wrongly. On "crowded, 5 robots" the cheapest
  design that holds has p = 0.9501, which is as hard as it gets: the search may refute it once in forty studies
  (alpha_refute), and of 200 seeds it did in 7.
- **What was looked at first.** "crowded" was drawn up and counted first; it missed the bar on runs, and "even", on
  which all searches are compared, was drawn up after that. With refutations that bet uniformly below p0 "even" took
  1.07, 1.08 and 0.69 %; the grid of shortfalls on which they bet now (`rfiddesign/optimize/share_test.py`) was chosen
  among sixteen that were tried on the first 20 seeds of both lists. It takes no more runs than before at any p,
  whatever the list. The bar on right answers, 97 %, is held by the mean over the fleets of each list; what the
  certificate promises is 95 %.
- **Exhaustive** runs every design {N_FIXED} times and returns the cheapest that passed enough of them.
- **TPE and random search** get, seed by seed, as many runs as the certified search used. Random search tries designs
  without repetition, {", ".join(map(str, RANDOM_RUNS))} runs each. TPE minimizes the price; its constraint
  (`trial.set_constraint`) is the share of {" or ".join(map(str, TPE_RUNS))} runs that
  passed, and a design that it asks
  for again is run further. Both return the cheapest design that passed at least a share of its runs, which is one of
  {", ".join(f"{share:.0%}" for share in SHARES)}.
- **Rules in hindsight.** How many runs for each design and how many of them must pass is chosen for exhaustive, TPE and
  random search after the fact: the best over all seeds of a landscape, which a user would not know beforehand. The
  certified search has no such freedom: p0 = 0.95, p1 = 0.90 and 2.5 % for each kind of error are declared before the
  first run.
"""
