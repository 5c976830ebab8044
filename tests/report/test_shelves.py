"""Floor against shelves: figures, tables and file say what the record holds."""

import csv
import io
import shutil

import numpy as np
import pytest

from rfiddesign.floor.scenes import laboratory
from rfiddesign.report import write_report
from rfiddesign.report.contents import read_contents
from rfiddesign.report.extras import extras
from rfiddesign.report.figures.scene import scene_figure
from rfiddesign.report.figures.shelves import families_figure, hall_figure
from rfiddesign.report.figures.style import in_style
from rfiddesign.report.shelves import cheaper_table, design_table, promised, shelves_csv
from rfiddesign.results.folder import write_record
from rfiddesign.results.shelves import FamilyAnswer, HallRecord, Shelves, TestedRecord
from rfiddesign.results.study_result import CostLineRecord, Limit, MeanRecord

EVIL = '=cmd|<script>alert("x")</script>'
ROBOTS, FACTORS = (1, 20), (0.5, 1.0)
#: Cents by (family, robots, factor); None: every design was refuted.
PRICES = {
    ("floor", 1, 0.5): 900_000, ("floor", 20, 0.5): 1_400_000, ("shelves", 1, 0.5): None, ("shelves", 20, 0.5): None,
    ("floor", 1, 1.0): 850_000, ("floor", 20, 1.0): 1_300_000, ("shelves", 1, 1.0): 700_000,
    ("shelves", 20, 1.0): 5_000_000,
}  # fmt: skip


def answer(family: str, n_robots: int, factor: float) -> FamilyAnswer:
    cents = PRICES[family, n_robots, factor]
    line = CostLineRecord(
        group="per project", item=EVIL, quantity="1", unit="piece", unit_price="1", amount_cents=cents or 0, source=EVIL
    )
    return FamilyAnswer(
        family=family, n_robots=n_robots, factor=factor,
        limits=[Limit(metric="position_p95_mm", limit=400.0 * factor)],
        claim="none holds" if cents is None else "cheapest", winner=None if cents is None else 3, name=EVIL,
        cost_cents=cents, cost_lines=[] if cents is None else [line], lower_bound_cents=cents, n_undecided=0,
        n_runs=60, n_passed=58, n_runs_used=400,
    )  # fmt: skip


def looked_at(family: str, number: int, cents: int, error: float, n_complete: int = 60) -> TestedRecord:
    return TestedRecord(
        family=family, number=number, name=EVIL, n_tags=300, costs_cents=[cents, 3 * cents], n_runs=60,
        n_complete=n_complete, error=MeanRecord(mean=error, stderr=5.0),
    )  # fmt: skip


@pytest.fixture
def shelves() -> Shelves:
    return Shelves(
        version="0", study_hash="0", currency="EUR", metric="position_p95_mm",
        hall=HallRecord(
            length_mm=24_000.0, width_mm=16_000.0, rows_mm=[(2_200.0, 2_500.0, 21_800.0, 3_700.0)], area_m2=290.0
        ),
        robots=list(ROBOTS), factors=list(FACTORS), hold_probability=0.9, fail_probability=0.75, alpha_refute=0.05,
        alpha_certify=0.04, n_floor_designs=162, n_shelf_designs=36, training_drive_s=300.0,
        answers=[answer(*key) for key in PRICES],
        tested=[
            looked_at("floor", 3, 850_000, 40.0), looked_at("shelves", 3, 700_000, 300.0),
            # Cut short: its error is a lower bound and not drawn.
            looked_at("floor", 4, 10_000, 9.0, n_complete=3),
        ],
        runs_sha256="0",
    )  # fmt: skip


def test_the_table_says_who_is_cheaper_and_by_how_much(shelves):
    rows = {(row[0], row[1]): row[2:] for row in cheaper_table(shelves).rows}
    at = "the position error is at most {} mm (95th percentile)"
    assert rows[at.format(400), "1"] == ("EUR 8,500.00", "EUR 7,000.00", "tags on shelves, by EUR 1,500.00")
    assert rows[at.format(400), "20"] == ("EUR 13,000.00", "EUR 50,000.00", "tags in the floor, by EUR 37,000.00")
    assert rows[at.format(200), "1"][1:] == ("all refuted", "tags in the floor; the others were all refuted")


def test_a_design_stands_once_with_all_it_is_the_answer_for(shelves):
    rows = design_table(shelves).rows
    assert len(rows) == 2
    assert rows[0][2] == "1 at x 0.5, 20 at x 0.5, 1 at x 1, 20 at x 1"
    assert rows[1][2] == "1 at x 1, 20 at x 1"


def test_the_chances_of_both_families_are_added(shelves):
    assert "at most 4 %; in both families together, of at most 8 %" in promised(shelves)[0]


def test_the_file_has_a_row_for_each_answer_and_no_formulas(shelves):
    rows = list(csv.DictReader(io.StringIO(shelves_csv(shelves))))
    assert len(rows) == len(PRICES)
    for row in rows:
        assert not row["design"].startswith("=")
        cents = PRICES[row["family"], int(row["robots"]), float(row["limits_factor"])]
        assert row["price"] == ("" if cents is None else f"{cents / 100:.2f}")


def axis_words(figure):
    with in_style():
        figure.draw_without_rendering()
        box = figure.get_tightbbox()
    assert box.x0 >= -0.03
    assert box.y0 >= -0.03
    assert box.x1 <= figure.get_figwidth() + 0.03
    return [word for axes in figure.axes for word in (axes.get_xlabel(), axes.get_ylabel()) if word]


def test_figures_name_their_axes_with_units_and_fit_their_paper(shelves):
    scene = laboratory()
    reads = (np.linspace(500, 9_500, 10), np.linspace(500, 6_500, 7), np.ones((7, 10)))
    assert all("[" in word for word in axis_words(families_figure(shelves, 20)))
    assert all("[m]" in word for word in axis_words(hall_figure(shelves)))
    assert all("[m]" in word for word in axis_words(scene_figure(scene, np.array([[1e3, 1e3], [3e3, 5e3]]))))
    assert "tags expected in a snapshot" in axis_words(scene_figure(scene, None, reads))


def test_the_figure_shows_prices_of_its_fleet_and_only_complete_errors(shelves):
    for n_robots, scale in ((1, 1), (20, 3)):
        axes = families_figure(shelves, n_robots).axes[0]
        points = np.concatenate([c.get_offsets() for c in axes.collections if len(c.get_offsets())])
        costs = {round(float(x)) for x, _ in points}
        certified = {cents // 100 for (_, n, _), cents in PRICES.items() if n == n_robots and cents is not None}
        assert costs == certified | {8_500 * scale, 7_000 * scale}
        assert 9.0 not in points[:, 1]


def test_without_any_certified_or_complete_design_the_figure_says_so(shelves):
    nothing = shelves.model_copy(update={"tested": [], "answers": [
        each.model_copy(update={"cost_cents": None, "winner": None}) for each in shelves.answers
    ]})  # fmt: skip
    words = families_figure(nothing, 1).axes[0].texts[0].get_text()
    assert "No design of either family" in words


@pytest.mark.usefixtures("without_pictures")
def test_text_from_users_is_escaped_on_the_page(folder, shelves, tmp_path):
    copied = shutil.copytree(folder, tmp_path / "out")
    write_record(copied / "shelves.json", shelves)
    contents = read_contents(copied)
    extra = next(each for each in extras(contents) if each.key == "shelves")
    assert any(EVIL in bill.title for bill in extra.part.bills)
    write_report(copied)
    page = (copied / "report.html").read_text()
    assert 'id="shelves"' in page
    assert "<script>alert" not in page
