"""What the page says of routes, from a made-up record."""

from dataclasses import replace

import pytest

from rfiddesign.report.contents import read_contents
from rfiddesign.report.figures.place import place_on_route
from rfiddesign.report.fleets import tag_density_cents
from rfiddesign.report.routes import routes_extra
from rfiddesign.results.routes import (
    CheapestRecord,
    DriveCheckRecord,
    EdgeRecord,
    NetworkRecord,
    PlacementRecord,
    RoutesRecord,
)
from rfiddesign.results.study_result import DecisionRecord

NETWORK = NetworkRecord(
    n_stations=2,
    nodes_mm=[(1000, 1000), (9000, 4000)],
    edges=[EdgeRecord(nodes=(0, 1), points_mm=[(1000, 1000), (7000, 1000), (9000, 4000)])],
    length_m=9.6,
    swath_m2=6.1,
    half_width_mm=300,
    lateral_mm=50,
    yaw_deg=3,
)
DRIVE = DriveCheckRecord(
    planned_mm=480, planned_spare_mm=496, random_mm=531, random_spare_mm=600, random_share_over=0.001, n_drives=38,
    driven_m=400,
)  # fmt: skip
PLACEMENT = PlacementRecord(
    n_robots=5, design=0, layout="cross<8>", antenna="60x60", distance_mm=500, n_spare=1, is_in_lines=False, n_tags=120,
    lower_bound=90, gap=0.25, method="search", n_windows=3000, n_unserved=4, unserved=[(2000, 1000, 0)], min_cover=2,
    drive=DRIVE, n_tags_in_lines=150, in_lines_cents=2250,
)  # fmt: skip


def cheapest(is_whole_floor, cents):
    winner = DecisionRecord(design=0, cost_cents=cents, verdict="certified", n_runs=137, n_passed=137)
    return CheapestRecord(
        n_robots=5, is_whole_floor=is_whole_floor, n_candidates=10, is_answer=not is_whole_floor, claim_words="",
        winner=winner, name="a design", n_tags=120, tagged_m2=6.1, n_runs_used=500,
    )  # fmt: skip


@pytest.fixture(scope="module")
def contents(folder):
    routes = RoutesRecord(
        network=NETWORK, placements=[PLACEMENT], cheapest=[cheapest(False, 100_000), cheapest(True, 160_000)]
    )
    return replace(read_contents(folder), routes=routes)


def test_without_routes_there_is_no_section(folder):
    assert routes_extra(read_contents(folder)) is None


def test_the_section_gives_prices_side_by_side_and_what_is_saved(contents):
    part = routes_extra(contents).part
    assert "2 stations along 10 m of routes" in part.network
    assert [row[1] for row in part.cheapest.rows] == ["routes alone", "whole floor"]
    (saving,) = part.savings
    assert "EUR 600.00 less" in saving
    assert "37.5 %" in saving


def test_the_section_gives_tags_bound_gap_and_what_lines_cost(contents):
    ((heading, table, words),) = routes_extra(contents).part.placements
    rows = dict(table.rows[:6])
    assert "cross<8>" in heading
    assert rows["tags"] == "120"
    assert rows["fewest that any choice of the candidate places needs"] == "90"
    assert rows["gap: tags that the bound leaves open"] == "25 %"
    assert rows["of these, windows that no tags can serve"] == "4"
    assert any("150 tags: 30 more, EUR 22.50" in sentence for sentence in words)


def test_there_is_a_plan_for_every_fleet_with_an_answer(contents):
    won = [answer.key for answer in contents.answers if answer.chosen is not None]
    assert won
    assert [picture.name for picture in routes_extra(contents).pictures] == [f"routes-{key}" for key in won]


def test_the_close_up_is_where_a_route_leads_along_x():
    assert place_on_route(NETWORK) == (4000.0, 1000.0)


def test_one_more_tag_per_square_metre_is_counted_on_what_is_tagged(contents):
    """0.21 + 0.35 per tag on the 126 m2 whose covering the answer pays for."""
    few = contents.answers[0]
    covering = next(line for line in few.record.cost_lines if line.item == "covering")
    lines = [line.model_copy(update={"quantity": "10"}) if line is covering else line for line in few.record.cost_lines]
    on_routes = replace(few, record=few.record.model_copy(update={"cost_lines": lines}))
    assert tag_density_cents(contents, on_routes) == 56 * 10
