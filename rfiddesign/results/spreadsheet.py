"""Cost lines as a file for a spreadsheet: exact amounts, and text that cannot be taken for a formula."""

import csv
import io
from decimal import Decimal, InvalidOperation
from pathlib import Path

from rfiddesign.results.folder import write_text
from rfiddesign.results.study_result import AnswerRecord

COST_HEADER = ("group", "item", "quantity", "unit", "unit_price", "currency", "amount", "source")
#: A cell that begins with one of these may be taken for a formula by a spreadsheet.
FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "\n")

#: Where an estimator that was left open comes from.
CHOSEN = "chosen by the search"


def cost_csv(answer: AnswerRecord, estimator: str | None = None) -> str:
    """The cost lines of an answer as CSV with a total row; amounts are exact, text cannot be taken for a formula.

    An estimator that the search chose has a line of its own, which costs nothing.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COST_HEADER)
    for line in answer.cost_lines:
        amount = exact_amount(line.amount_cents)
        cells = (line.group, line.item, line.quantity, line.unit, line.unit_price, answer.currency, amount, line.source)
        writer.writerow(cells[i] if name == "amount" else plain_cell(cells[i]) for i, name in enumerate(COST_HEADER))
    if estimator is not None:
        cells = ("software", f"estimator {estimator}", "1", "piece", "0", answer.currency, exact_amount(0), CHOSEN)
        writer.writerow(map(plain_cell, cells))
    total = exact_amount(sum(line.amount_cents for line in answer.cost_lines))
    writer.writerow(("total", "", "", "", "", plain_cell(answer.currency), total, ""))
    return text.getvalue()


def write_cost_csv(path: Path, answer: AnswerRecord, estimator: str | None = None) -> None:
    """Write the cost lines of an answer, whole or not at all."""
    write_text(path, cost_csv(answer, estimator))


def plain_cell(text: str) -> str:
    """A cell as it is if it is a number, else with a leading apostrophe where a spreadsheet would see a formula."""
    try:
        if Decimal(text).is_finite() and text == text.strip():
            return text
    except InvalidOperation:
        pass
    return f"'{text}" if text.startswith(FORMULA_STARTS) else text


def exact_amount(cents: int) -> str:
    """Cents as a plain decimal, as "123456.78"."""
    return str((Decimal(cents) / 100).quantize(Decimal("0.01")))
