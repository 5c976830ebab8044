"""Exact coverage of discs over a lattice against shapely's unions."""

import numpy as np
import pytest
import shapely

from rfiddesign.geometry import coverage_by_heading, make_layout, make_pattern
from rfiddesign.geometry.areas import Disc
from tests.benchmarks.board import Row, race

# As many as 8 readers take for an average good to 1e-4.
HEADINGS = np.linspace(0, np.pi / 2, 64, endpoint=False)
AREA, PATTERN = Disc(30.0), make_pattern("square", pitch_mm=100.0)


def by_shapely(layout):
    """Share of lattice phases at which some reader sees a tag: union of the discs of all readers, folded to a cell."""
    (pitch, _), _ = PATTERN.lattice.basis_mm
    cell = shapely.box(0, 0, pitch, pitch)
    shares = []
    for heading in HEADINGS:
        turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
        phases = np.mod(-(layout.poses_mm[:, :2] @ turn.T), pitch)
        shifts = pitch * np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])
        centres = (phases[:, None] + shifts).reshape(-1, 2)
        is_near = ((centres > -AREA.radius_mm) & (centres < pitch + AREA.radius_mm)).all(axis=1)
        discs = shapely.buffer(shapely.points(centres[is_near]), AREA.radius_mm, quad_segs=64)
        shares.append(shapely.union_all(discs).intersection(cell).area / pitch**2)
    return np.array(shares)


def test_exact_coverage(benchmark, board):
    layout = make_layout("cross-8")

    def ours():
        return coverage_by_heading(layout, AREA, PATTERN.lattice, HEADINGS)

    # A circle of 256 chords is 1e-4 short of its area: as exact as the average is asked to be.
    assert ours()[:, 0] == pytest.approx(by_shapely(layout), abs=5e-4)
    best = race({"ours": ours, "shapely": lambda: by_shapely(layout)}, 7)
    benchmark.pedantic(ours, rounds=20)
    to_us = 1e6 / len(HEADINGS)
    board.rows.append(
        Row(
            "exact coverage, 8 readers, one of 64 headings", "us", best["ours"] * to_us,
            {"shapely union": best["shapely"] * to_us}, (("shapely union", 100, True),),
        )
    )  # fmt: skip
