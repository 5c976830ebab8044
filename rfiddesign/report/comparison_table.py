"""The comparison of variants as a table for a spreadsheet."""

import csv
import io

from rfiddesign.results.comparison import Comparison, SessionRecord, VariantAnswer, VariantRecord
from rfiddesign.results.spreadsheet import exact_amount, plain_cell

HEADER = (
    "robots", "group", "condition", "variant", "settings", "claim", "currency", "price", "saving", "saving_percent",
    "design", "layout", "antenna", "pattern", "tags_per_m2", "readers", "tags", "drives", "drives_passed",
    "cheaper_undecided", "lower_bound", "drives_looked_at", "seconds",
)  # fmt: skip


def comparison_csv(comparison: Comparison, sessions: dict[str, SessionRecord | None]) -> str:
    """One line per fleet and variant; amounts are exact, text cannot be taken for a formula.

    `sessions` : the last session of each variant, by name; its seconds are those of all fleets.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER)
    for n_robots in comparison.fleets:
        for variant in comparison.variants:
            answer = variant.answer(n_robots)
            if answer is not None:
                cells = _cells(variant, answer, sessions.get(variant.name))
                writer.writerow(plain_cell(cells.get(name, "")) for name in HEADER)
    return text.getvalue()


def _cells(variant: VariantRecord, answer: VariantAnswer, session: SessionRecord | None) -> dict[str, str]:
    cells = {
        "robots": str(answer.n_robots),
        "group": variant.group,
        "condition": variant.condition,
        "variant": variant.name,
        "settings": "; ".join(f"{key} = {value}" for key, value in variant.settings.items()),
        "claim": answer.claim,
        "currency": answer.currency,
        "cheaper_undecided": str(answer.n_undecided),
        "drives_looked_at": str(answer.n_runs_used),
    }
    if answer.lower_bound_cents is not None:
        cells["lower_bound"] = exact_amount(answer.lower_bound_cents)
    if answer.saving is not None:
        cells["saving"] = exact_amount(answer.saving.cents)
        cells["saving_percent"] = f"{100 * answer.saving.share:.2f}"
    if session is not None:
        cells["seconds"] = f"{session.wall_s:.1f}"
    winner = answer.winner
    if winner is not None:
        cells |= {
            "price": exact_amount(winner.cost_cents),
            "design": winner.name,
            "layout": winner.layout,
            "antenna": winner.antenna,
            "pattern": winner.pattern,
            "tags_per_m2": f"{winner.tags_per_m2:g}",
            "readers": str(winner.n_readers),
            "tags": str(winner.n_tags),
            "drives": str(winner.n_runs),
            "drives_passed": str(winner.n_passed),
        }
    return cells
