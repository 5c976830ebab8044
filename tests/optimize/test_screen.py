"""The screen by expected reads: what it counts, and what it removes."""

import numpy as np
import pytest

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.geometry import coverage, make_layout, make_pattern
from rfiddesign.optimize.screen import expected_reads, screen_by_reads

DESIGNS = tuple(
    Design(make_layout(layout), antenna(name), make_pattern(kind, tags_per_m2=density))
    for layout in ("cross-8", "cross-20", {"kind": "single"})
    for name in ("60x60", "320x230")
    for kind in ("square", "triangular")
    for density in (16.0, 100.0)
)


def test_expected_reads_are_those_of_the_whole_layout():
    found = expected_reads(DESIGNS)
    for design, reads in zip(DESIGNS, found, strict=True):
        together = coverage(design.layout, design.antenna.area, design.pattern).expected_reads
        assert reads == pytest.approx(together, rel=1e-4)


def test_where_no_two_tags_share_a_view_a_reader_reads_area_times_density():
    design = Design(make_layout("cross-8"), antenna("60x60"), make_pattern("square", tags_per_m2=100.0))
    assert expected_reads((design,)) == pytest.approx([8 * np.pi * 30.0**2 * 100e-6], rel=1e-9)


def test_the_screen_removes_exactly_what_falls_short_and_says_so():
    reads = expected_reads(DESIGNS)
    is_kept, screen = screen_by_reads(reads, 1.0)
    assert is_kept.tolist() == (reads >= 1.0).tolist()
    assert 0 < screen.n_removed == np.count_nonzero(reads < 1.0) < len(DESIGNS)
    assert screen.rule == "fewer than 1 expected reads per poll of all readers"
    assert screen.kind == "heuristic"


def test_without_a_minimum_nothing_is_removed():
    is_kept, screen = screen_by_reads(np.full(len(DESIGNS), np.inf), 0.0)
    assert is_kept.all()
    assert screen.n_removed == 0
