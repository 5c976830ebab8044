"""Cost tables add up to the cent and cannot run in a spreadsheet."""

import csv
from decimal import Decimal

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from rfiddesign.catalog import antenna, reader
from rfiddesign.geometry import make_layout, make_pattern
from rfiddesign.optimize import Space, unbuildable
from rfiddesign.report.contents import read_contents
from rfiddesign.report.tables import (
    antenna_table,
    area_table,
    comparison_table,
    cost_table,
    front_table,
    neighbour_table,
    screen_table,
    unbuildable_table,
)
from rfiddesign.results.spreadsheet import COST_HEADER, FORMULA_STARTS, plain_cell
from rfiddesign.results.study_result import UnbuildableRecord


@pytest.fixture(scope="module")
def contents(folder):
    return read_contents(folder)


@pytest.mark.parametrize("place", ["cost.csv", "robots-200/cost.csv"])
def test_cost_csv_sums_to_its_total_and_to_the_price(folder, contents, place):
    """Each amount is quantity times unit price to the cent, and all of them make the price."""
    with (folder / place).open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COST_HEADER
    *lines, total = rows
    assert total["group"] == "total"
    for line in lines:
        exact = Decimal(line["quantity"]) * Decimal(line["unit_price"])
        assert abs(exact - Decimal(line["amount"])) <= Decimal("0.005")
    assert sum(Decimal(line["amount"]) for line in lines) == Decimal(total["amount"])
    answer = contents.answers[0 if place == "cost.csv" else 1]
    assert Decimal(total["amount"]) * 100 == answer.record.winner.cost_cents


def test_a_formula_in_a_source_is_only_text(folder):
    with (folder / "cost.csv").open(newline="", encoding="utf-8") as file:
        sources = [row["source"] for row in csv.DictReader(file)]
    assert "'=HYPERLINK(A1)" in sources
    assert not any(source.startswith(FORMULA_STARTS) for source in sources)


@given(st.text())
def test_no_cell_of_text_begins_like_a_formula(text):
    """Numbers may keep their sign; everything else loses nothing but gains an apostrophe where needed."""
    cell = plain_cell(text)
    assert cell in (text, f"'{text}")
    if cell.startswith(FORMULA_STARTS):
        assert Decimal(cell).is_finite()


def test_numbers_stay_numbers():
    assert plain_cell("-12.50") == "-12.50"
    assert plain_cell("-12.50 EUR") == "'-12.50 EUR"
    assert plain_cell("+Infinity") == "'+Infinity"


def test_every_row_has_a_cell_for_every_column(contents):
    tables = [comparison_table(contents), front_table(contents.result), area_table(contents.result)]
    tables += [screen_table(contents.result), unbuildable_table(contents.result)]
    for answer in contents.answers:
        tables += [cost_table(answer.record), neighbour_table(contents, answer), antenna_table(answer)]
    for table in tables:
        assert table.rows
        for row in (*table.rows, *([table.total] if table.total else [])):
            assert len(row) == len(table.headers)


def test_reasons_are_grouped(contents):
    """Two antennas do not fit one layout for the same two reasons."""
    rows = unbuildable_table(contents.result).rows
    assert [row[:3] for row in rows] == [
        ("antennas overlap and stick out of the robot", "60x60 mm", "1 layout"),
        ("antennas overlap and stick out of the robot", "80x80 mm", "1 layout"),
    ]
    first = screen_table(contents.result).rows[1]
    assert first == ("cannot be built: antennas overlap or stick out of the robot", "−40")


def test_patterns_too_dense_for_a_reader_are_one_row_per_antenna(contents):
    """In the words of the check itself; a layout that does not fit keeps its own row."""
    layouts = (make_layout("cross-8"), make_layout({"kind": "bar", "n": 2, "spacing_mm": 70.0}))
    patterns = tuple(make_pattern(kind, tags_per_m2=n) for kind in ("square", "triangular") for n in (6.25, 100, 400))
    antennas = (antenna("60x60"), antenna("80x80"))
    space = Space(layouts, antennas, patterns, reader("goetting-hg-g-98830"))
    faults = unbuildable(space, shapely.Point(0, 0).buffer(300.0, quad_segs=64))
    records = [
        UnbuildableRecord(layout=fault.layout_name, antenna=fault.antenna_name, reason=fault.reason) for fault in faults
    ]
    result = contents.result
    result = result.model_copy(update={"space": result.space.model_copy(update={"unbuildable": records})})
    table = unbuildable_table(result)
    one_tag = "a reader that must see one tag at a time may see two"
    dense = "square 400 tags/m², triangular 400 tags/m²"
    assert table.rows == (
        (one_tag, "60x60 mm", "2 patterns", dense),
        (one_tag, "80x80 mm", "2 patterns", dense),
        ("antennas overlap", "80x80 mm", "1 layout", "bar-2"),
    )
    assert "any layout" not in str(table)
    words = screen_table(result).rows[1][0]
    assert words == f"cannot be built: antennas overlap or stick out of the robot, or {one_tag}"


def test_errors_of_drives_cut_short_are_marked(contents):
    """An undecided design, some of whose drives were stopped, has the error seen until then."""
    rows = neighbour_table(contents, contents.answers[1]).rows
    errors = {row[0]: row[4] for row in rows}
    assert errors["undecided (lower bound)"].endswith("(some drives cut short)")
    assert "cut short" not in errors["cheapest certified"]


def test_prices_at_other_limits_say_whether_they_are_certified(contents):
    """The made-up fronts: nothing at half the limits, a certificate up to 1.5 times, an estimate at twice."""
    rows = {row[0]: row[2] for row in front_table(contents.result).rows}
    assert rows["× 0.5"] == "none among those tested"
    assert rows["× 1"] == "EUR 20,106.80"
    assert "estimate" not in rows["× 1.5"]
    assert "(estimate: " in rows["× 2"]
