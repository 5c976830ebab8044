"""The map of regimes: figures, table and file say what the record holds, and nothing is drawn without one."""

import csv
import io
from html.parser import HTMLParser

import pytest

from rfiddesign.report import write_report
from rfiddesign.report.contents import read_contents
from rfiddesign.report.extras import extras
from rfiddesign.report.figures.regimes import (
    family_names,
    price_per_m2_figure,
    regimes_figure,
    robots_share_figure,
)
from rfiddesign.report.figures.style import in_style
from rfiddesign.report.regimes import band_table, bands, promised, regimes_csv
from rfiddesign.report.words import short_money
from rfiddesign.results.folder import read_record, write_record
from rfiddesign.results.regimes import RegimeBoundary, RegimeCell, RegimeDesign, Regimes

FLEETS, AREAS_M2 = (1, 4, 16, 64, 256), (100.0, 400.0, 1600.0)
EVIL = '<script>alert("x")</script>'


def design(number: int, n_readers: int, per_robot: float, per_m2: float, layout: str) -> RegimeDesign:
    return RegimeDesign(
        number=number, name=f"{layout}, 80x80, square, {per_m2:g} tags/m2", layout=layout, antenna="80x80",
        pattern="square", tags_per_m2=per_m2, n_readers=n_readers, estimator="mcl", per_robot=per_robot, per_m2=per_m2,
    )  # fmt: skip


DESIGNS = [design(3, 12, 900.0, 20.0, EVIL), design(8, 4, 300.0, 32.0, "ring-4"), design(9, 1, 100.0, 90.0, "=SUM(A1)")]


def cell(n_robots: int, area_m2: float) -> RegimeCell:
    prices = {d.number: round(100 * (n_robots * d.per_robot + area_m2 * d.per_m2 + 50)) for d in DESIGNS}
    winner = min(prices, key=prices.get)
    chosen = next(d for d in DESIGNS if d.number == winner)
    robots, tags = round(100 * n_robots * chosen.per_robot), round(80 * area_m2 * chosen.per_m2)
    return RegimeCell(
        n_robots=n_robots, area_m2=area_m2, claim="cheapest", winner=winner, lower_bound=winner,
        lower_bound_cents=prices[winner], n_undecided=0, n_runs=140, n_passed=138,
        n_tags=round(chosen.tags_per_m2 * area_m2), cost_cents=prices[winner], robots_cents=robots, tags_cents=tags,
        area_cents=prices[winner] - robots - tags - 5000, project_cents=5000, n_runs_used=700,
    )  # fmt: skip


@pytest.fixture
def regimes() -> Regimes:
    """A map with three winners, a cell without one and a cell with cheaper designs undecided."""
    cells = [cell(n, area) for area in AREAS_M2 for n in FLEETS]
    nothing = dict.fromkeys(
        ("n_runs", "n_passed", "n_tags", "cost_cents", "robots_cents", "tags_cents", "area_cents", "project_cents"), 0
    )
    last = cells[4]
    cells[4] = last.model_copy(update={"claim": "none certified", "winner": None, "n_undecided": 3} | nothing)
    cells[7] = cells[7].model_copy(update={"claim": "certified, cheaper undecided", "n_undecided": 2})
    return Regimes(
        version="0", study_hash="0", currency="EUR", reference_floor="hall", reference_area_m2=400.0,
        hold_probability=0.95, fail_probability=0.9, alpha_refute=0.002, alpha_certify=0.025, n_designs=300, n_mixes=7,
        tolerance_cents=86, n_runs=4321, cells=cells, designs=DESIGNS,
        boundaries=[
            RegimeBoundary(below=3, above=8, robots_per_1000_m2=20.0),
            RegimeBoundary(below=8, above=9, robots_per_1000_m2=290.0),
        ],
    )  # fmt: skip


def words_of(figure) -> list[str]:
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def test_the_record_survives_its_file(regimes, tmp_path):
    write_record(tmp_path / "regimes.json", regimes)
    assert read_record(tmp_path / "regimes.json", Regimes) == regimes


def test_every_cell_of_the_map_names_its_price_and_tags(regimes):
    words = words_of(regimes_figure(regimes))
    assert len(words) == len(regimes.cells)
    for one, text in zip(regimes.cells, words, strict=True):
        if one.winner is None:
            assert text == f"open\n≥ {short_money(one.lower_bound_cents / 100)}"
        else:
            tags = f"{regimes.design(one.winner).tags_per_m2:g} sq"
            assert text == f"{tags}{'*' if one.n_undecided else ''}\n{short_money(one.cost_cents / 100)}"


def test_families_are_named_once_from_sparse_use_to_dense(regimes):
    assert family_names(regimes) == [f"{EVIL}, 80x80 mm", "ring-4, 80x80 mm", "=SUM(A1), 80x80 mm"]


@pytest.mark.parametrize("draw", [regimes_figure, robots_share_figure, price_per_m2_figure])
def test_axes_have_units_and_nothing_sticks_out(regimes, draw):
    figure = draw(regimes)
    with in_style():
        figure.draw_without_rendering()
        box = figure.get_tightbbox()
    assert (box.x0 >= -0.03, box.y0 >= -0.03) == (True, True)
    assert box.x1 <= figure.get_figwidth() + 0.03
    assert box.y1 <= figure.get_figheight() + 0.03
    (axes,) = figure.axes
    assert axes.get_xlabel() == "tagged floor [m²]"
    assert axes.get_ylabel() == "robots of the fleet"


def test_shares_of_the_price_are_the_cells_own(regimes):
    words = words_of(robots_share_figure(regimes))
    won = [one for one in regimes.cells if one.winner is not None]
    assert words == [f"{100 * one.robots_cents / one.cost_cents:.0f}" for one in won]


def test_the_rule_covers_the_map_without_gaps_between_winners(regimes):
    found = bands(regimes)
    assert [band.design.number if band.design else None for band in found] == [3, 8, 9, None]
    assert (found[0].low, found[0].high, found[1].low, found[1].high) == (None, 20.0, 20.0, 290.0)
    # Towards a cell without a winner a range ends at its last own cell.
    assert found[2].high == pytest.approx(640.0)
    assert (found[3].low, found[3].high) == (2560.0, None)
    assert [row[0] for row in band_table(regimes).rows] == ["up to 20", "20 to 290", "290 to 640", "from 2.56e+03"]


def test_prices_in_the_file_are_sums_of_their_parts_and_no_formula(regimes):
    rows = list(csv.DictReader(io.StringIO(regimes_csv(regimes))))
    assert len(rows) == len(regimes.cells)
    for row in rows:
        if row["price"]:
            parts = [float(row[f"{name}_price"]) for name in ("robots", "tags", "area", "project")]
            assert float(row["price"]) == pytest.approx(sum(parts), abs=1e-6)
        assert not row["layout"].startswith("=")


def test_claims_over_the_map_name_their_chances(regimes):
    text = " ".join(promised(regimes))
    assert "14 of 15 cells" in text
    assert "at most 2.5 %" in text
    assert "at most 1.4 %" in text  # 7 mixes times 0.2 %
    assert "to within EUR 0.86" in text
    useless = regimes.model_copy(update={"alpha_refute": 0.2})
    assert "In all cells at once" not in " ".join(promised(useless))


@pytest.mark.usefixtures("without_pictures")
def test_the_page_shows_a_map_only_where_there_is_one(synthetic, regimes, tmp_path):
    synthetic.write_folder(tmp_path, (5,))
    assert extras(read_contents(tmp_path)) == ()
    write_record(tmp_path / "regimes.json", regimes)
    write_report(tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert 'id="regimes"' in page
    scripts = []

    class Scripts(HTMLParser):
        def handle_starttag(self, tag, attributes):
            scripts.extend([tag] if tag == "script" else [])

    Scripts().feed(page)
    assert scripts == []
    assert (tmp_path / "regimes.csv").read_text() == regimes_csv(regimes)
