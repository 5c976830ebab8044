"""Numbers and sentences as a buyer reads them."""

import math

import pytest

from rfiddesign.report.certificate import headline, how_tested, not_promised, promised
from rfiddesign.report.contents import read_contents
from rfiddesign.report.fleets import fleet_sentences, reader_cents, tag_density_cents
from rfiddesign.report.words import grouped, metric_value, percent, requirement_words, short_money
from rfiddesign.results.spreadsheet import exact_amount
from rfiddesign.results.study_result import Limit, RequirementRecord
from rfiddesign.units import money


@pytest.fixture(scope="module")
def contents(folder):
    return read_contents(folder)


def test_money_is_exact_and_grouped():
    assert money(12_345_678, "EUR") == "EUR 123,456.78"
    assert money(5, "USD") == "USD 0.05"
    assert money(-150, "USD") == "USD -1.50"
    assert exact_amount(12_345_678) == "123456.78"
    assert exact_amount(100) == "1.00"
    assert short_money(12_345.0) == "12.3k"


def test_quantities_keep_their_digits():
    assert grouped("12600") == "12,600"
    assert grouped("1304.50") == "1,304.5"
    assert grouped("1E+3") == "1,000"
    assert percent(0.025, 2) == "2.5 %"
    assert percent(1.0) == "100 %"
    assert percent(0.9) == "90 %"


def test_headings_are_said_in_degrees():
    assert metric_value("heading_p95_rad", math.radians(2)) == "2°"
    assert metric_value("position_p95_mm", 123.4) == "123 mm"
    requirement = RequirementRecord(
        limits=[Limit(metric="position_max_mm", limit=50.0), Limit(metric="lost_share", limit=0.02)],
        converged_within_s=None,
    )
    words = "the position error is at most 50 mm (maximum) and it is lost for at most 2 % of the time"
    assert requirement_words(requirement) == f"A drive passes if {words}."


def test_the_promise_names_its_chance_of_being_wrong(contents):
    certified, cheaper, both = promised(contents, contents.answers[0])
    assert "more than 90 % of drives" in certified
    assert "at most 2.5 %" in certified
    assert "300 designs" in certified
    assert "95 % or more of drives" in cheaper
    assert "at most 5 %" in both
    assert headline(contents.answers[0], contents.result.test).endswith("Every cheaper candidate was refuted.")


def test_undecided_designs_weaken_the_claim(contents):
    """The second fleet has cheaper designs without a verdict: that is said first, and among what is not promised."""
    answer = contents.answers[1]
    assert answer.record.undecided
    assert "stayed undecided" in headline(answer, contents.result.test)
    assert any("for 200 robots: 2 cheaper designs" in sentence for sentence in not_promised(contents))
    assert "the lower bound" in promised(contents, answer)[1]


def test_the_limits_of_the_promise_are_said(contents):
    words = " ".join(not_promised(contents))
    for needed in ("simulated", "Between 90 % and 95 %", "designs outside the space"):
        assert needed in words
    assert "seed 11" in " ".join(how_tested(contents))


def test_a_reader_on_every_robot_is_weighed_against_a_tag_on_every_square_metre(contents):
    """38.50 + 9.20 + 4.75 per reader and robot; 0.21 + 0.35 per tag on 126 m2."""
    few, many = contents.answers
    assert reader_cents(contents, few) == 5 * 5245
    assert reader_cents(contents, many) == 200 * 5245
    assert tag_density_cents(contents, few) == 56 * 126
    assert any("149 tags on each m²" in sentence for sentence in fleet_sentences(contents))
