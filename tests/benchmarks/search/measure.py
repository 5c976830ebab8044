"""Measure the landscapes that searches are compared on: `nice python -m tests.benchmarks.search.measure LIST`.

Every design of an enlarged willow-office space is run through that study's scenario, and `passed-LIST.csv` beside this
file gets how many of its runs passed.  Designs that pass most of a few runs are run more often, for there the landscape
decides.  Takes some six minutes of one core.
"""

import csv
import sys
from dataclasses import replace
from itertools import product
from pathlib import Path

from rfiddesign.design import Design
from rfiddesign.geometry import make_layout
from rfiddesign.optimize import unbuildable
from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.study import load_study
from rfiddesign.study.load import Study, floor_of, scenario_of, space_of

STUDY = Path(__file__).parents[3] / "studies" / "willow-office"
#: Densities of the two lists [tags/m2]: evenly spaced (in their logarithm) over the range of willow-office, and crowded
#: where designs begin to hold.
DENSITIES = {
    "even": tuple(float(f"{4.0 * 100.0 ** (i / 19):.3g}") for i in range(20)),
    "crowded": (4, 5, 6.25, 7.5, 9, 10, 11, 13, 16, 18, 20, 25, 30, 36, 42, 49, 64, 100, 144, 225),
}
# It makes the pairs of layout and antenna that can be built fifty, and thus the designs 3,000.
BAR_10 = {"kind": "bar", "name": "bar-10", "n": 10, "spacing_mm": 55.0}
# Runs of every design; of those that passed at least this many of them, further runs.
N_FIRST, N_PROMISING, N_FURTHER = 12, 9, 36


def passed_path(which: str) -> Path:
    """Where the measured runs of a list lie."""
    return Path(__file__).with_name(f"passed-{which}.csv")


def listed(which: str) -> tuple[Study, list[Design]]:
    """The study with the densities of a list, and its designs that can be built, in the order of its space."""
    study = load_study(STUDY, (f"space.tags_per_m2={list(map(float, DENSITIES[which]))}",))
    space = space_of(study)
    space = replace(space, layouts=(*space.layouts, make_layout(BAR_10)))
    ruled_out = frozenset().union(*(misfit.numbers for misfit in unbuildable(space, study.footprint)))
    return study, [design for i, design in enumerate(space.designs()) if i not in ruled_out]


def main(which: str) -> None:
    """Run all designs of a list and write the table."""
    study, designs = listed(which)
    floor = floor_of(study)
    n_runs, n_passed = [0] * len(designs), [0] * len(designs)
    with Simulator(scenario_of(study, floor), study.file.seed, 1, study.requirement) as simulator:
        for begin, n, least in ((0, N_FIRST, 0), (N_FIRST, N_FURTHER, N_PROMISING)):
            chosen = [i for i in range(len(designs)) if n_passed[i] >= least]
            jobs = list(product(chosen, range(begin, begin + n)))
            runs = simulator.runs(Job(designs[i], run) for i, run in jobs)
            for (i, _), metrics in zip(jobs, runs, strict=True):
                n_runs[i] += 1
                n_passed[i] += study.requirement.is_met(metrics)
    with passed_path(which).open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(("layout", "antenna", "pattern", "tags_per_m2", "runs", "passed"))
        for design, n, passed in zip(designs, n_runs, n_passed, strict=True):
            pattern = design.pattern
            rows.writerow(
                (design.layout.name, design.antenna.name, pattern.name, f"{pattern.tags_per_m2:g}", n, passed)
            )


if __name__ == "__main__":
    main(sys.argv[1])
