"""What a reproduction leaves behind: its rows as JSON and CSV, its figures as PNG and SVG, its files as they are."""

import csv
import io
import json
from pathlib import Path

from rfiddesign.report.figures.drawing import svg_of, write_figure
from rfiddesign.reproduce.reproduce import Reproduced
from rfiddesign.reproduce.rows import rounded
from rfiddesign.results.folder import write_text
from rfiddesign.results.spreadsheet import plain_cell

ROWS, TABLE = "rows.json", "rows.csv"


def write_reproduction(found: Reproduced, folder: Path) -> None:
    """Write rows, figures and files into a folder; each file appears whole or not at all."""
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / ROWS, json.dumps(found.as_json(), indent=1, allow_nan=False) + "\n")
    write_text(folder / TABLE, _csv(found))
    for name, text in found.files.items():
        write_text(folder / name, text)
    for name, figure in found.figures.items():
        write_figure(folder, name, figure, svg_of(figure, name))


def _csv(found: Reproduced) -> str:
    """The rows for a spreadsheet, which must not take a name for a formula."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("table", "row", "metric", "published", "measured", "stderr", "unit"))
    for row in found.rows:
        names = (plain_cell(name) for name in (row.table, row.row, row.metric))
        numbers = (row.published, rounded(row.measured), rounded(row.stderr))
        writer.writerow((*names, *("" if n is None else n for n in numbers), row.unit))
    return text.getvalue()
