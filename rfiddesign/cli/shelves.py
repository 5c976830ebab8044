"""What `rfiddesign run` tells of designs that localize by tags on shelves, beside those of the floor."""

from itertools import groupby
from pathlib import Path
from typing import Any

from rfiddesign.report.shelves import UNSURE, cheaper_table
from rfiddesign.results.folder import SHELVES, read_record
from rfiddesign.results.shelves import Shelves


def shelves_of(folder: Path) -> Shelves | None:
    """Both families in a result folder; None if its study has no shelves."""
    return read_record(folder / SHELVES, Shelves) if (folder / SHELVES).exists() else None


def shelves_summary(shelves: Shelves) -> dict[str, Any]:
    """The answers of both families without their bills."""
    return {
        "currency": shelves.currency,
        "n_floor_designs": shelves.n_floor_designs,
        "n_shelf_designs": shelves.n_shelf_designs,
        "answers": [answer.model_dump(mode="json", exclude={"cost_lines"}) for answer in shelves.answers],
    }


def shelves_lines(shelves: Shelves) -> list[str]:
    """For each limit and fleet what both families cost, and which is cheaper."""
    lines, table = ["", "floor or shelf"], cheaper_table(shelves).rows
    for words, rows in groupby(table, key=lambda row: row[0]):
        lines.append(f"  {words}")
        for _, robots, floor, other, verdict in rows:
            fleet = f"{robots} robot{'' if robots == '1' else 's'}"
            lines.append(f"    {fleet}: tags in the floor {floor}, tags on shelves {other}; cheaper: {verdict}")
    if any(row[-1].endswith(UNSURE) for row in table):
        lines.append(f"  {UNSURE.strip()} the dearer family has cheaper designs without a verdict")
    return lines
