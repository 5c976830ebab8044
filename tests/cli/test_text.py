"""What commands print for people."""

from pathlib import Path

import pytest

from rfiddesign.cli.text import answer_lines
from rfiddesign.results.study_result import StudyResult
from rfiddesign.units import money


@pytest.mark.parametrize(
    ("cents", "text"), [(0, "EUR 0.00"), (5, "EUR 0.05"), (123_450, "EUR 1,234.50"), (10**11, "EUR 1,000,000,000.00")]
)
def test_money_has_thousands_and_two_decimals(cents, text):
    assert money(cents, "EUR") == text


def test_the_answer_is_design_price_certificate_and_the_way_to_the_report(finished):
    result = StudyResult.model_validate_json((finished / "result.json").read_bytes())
    text = "\n".join(answer_lines(result, finished, finished / "report.html"))
    names = {design.number: design.name for design in result.designs}
    for answer in result.answers:
        assert names[answer.winner.design] in text
        assert money(answer.winner.cost_cents, "EUR") in text
        assert f"{answer.winner.n_passed} of {answer.winner.n_runs} drives kept the limits" in text
    assert "in more than 40% of drives they hold (chance of error at most 20.0%)" in text
    assert text.count("  estimator    mcl (Monte-Carlo localization, 60 particles), about ") == 2
    assert f"report: {finished}/report.html" in text


def test_without_a_winner_it_is_said_that_there_is_none(finished):
    result = StudyResult.model_validate_json((finished / "result.json").read_bytes())
    answer = result.answers[0].model_copy(update={"winner": None, "claim_words": "every design was refuted"})
    text = "\n".join(answer_lines(result.model_copy(update={"answers": [answer]}), Path("out"), Path("page")))
    assert "no design certified: every design was refuted" in text
    assert "price" not in text
