"""Tags along the routes of a real office and readers under a robot, held against the bars that they were built for.

Counts are the same on every machine; seconds of processor time are printed and not asserted.  Run by name:
``pytest tests/benchmarks/placement -s``.
"""

import time

import pytest

from rfiddesign.catalog import antenna
from rfiddesign.floor import bundled_routes
from rfiddesign.geometry import make_layout, make_pattern
from rfiddesign.optimize.reader_placement import PlacementProblem, place_readers
from rfiddesign.optimize.tag_placement import PlacementRules, place_tags
from rfiddesign.study import load_study
from rfiddesign.study.load import floor_of

# Ten thousand rounds take a second, about.
ROUNDS = 300_000
BAR_OF_EIGHT = {"kind": "bar", "n": 8, "spacing_mm": 55.0}


@pytest.fixture(scope="module")
def routes():
    """20 stations of the Willow office, every pair joined by bundled paths."""
    network = bundled_routes(floor_of(load_study("studies/willow-office")), 20, 320.0)
    print(f"\nroutes: {network.length_mm / 1e3:.0f} m")
    return network.edges_mm


@pytest.mark.parametrize(
    ("layout", "most_tags", "widest_gap"), [("cross-8", 3650, 0.12), (BAR_OF_EIGHT, 2650, 0.20)], ids=["cross", "bar"]
)
def test_tags_along_routes(routes, layout, most_tags, widest_gap):
    begin, marks = time.process_time(), {}
    rules = PlacementRules(distance_mm=500.0, n_search_rounds=ROUNDS)
    found = place_tags(
        routes, make_layout(layout), antenna("60x60").area, rules,
        on_progress=lambda what, done, of: marks.__setitem__(what, time.process_time() - begin),
    )  # fmt: skip
    seconds = ", ".join(f"{what} until {at:.0f} s" for what, at in marks.items())
    print(
        f"\n{layout}: {found.n_tags:,} tags, bound {found.lower_bound:,}, gap {found.gap:.1%} ({found.method});"
        f" {seconds}, all {time.process_time() - begin:.0f} s; {found.drive}"
    )
    assert found.n_unserved == 0
    assert found.min_cover >= 2
    assert found.n_tags <= most_tags
    assert found.gap <= widest_gap
    # At the deviations that it was made for, by a drive that shares no code with the search.
    assert found.drive.planned_mm <= rules.distance_mm
    assert found.drive.planned_spare_mm <= rules.distance_mm


@pytest.mark.parametrize(("pitch_mm", "n_readers"), [(250.0, 5), (200.0, 4)])
def test_readers_under_a_robot(pitch_mm, n_readers):
    begin = time.process_time()
    problem = PlacementProblem(antenna("60x60"), make_pattern("square", pitch_mm=pitch_mm), 500.0, 320.0)
    found = place_readers(problem)
    print(f"\npitch {pitch_mm:g} mm: {found.layout.n_readers} readers, {time.process_time() - begin:.1f} s")
    assert found.layout.n_readers == n_readers
    assert found.is_proved
    assert found.is_guaranteed
