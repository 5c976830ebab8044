"""What `rfiddesign run` tells of the questions that a study may ask beside its own."""

from pathlib import Path
from typing import Any

from rfiddesign.cli.shelves import shelves_lines, shelves_of, shelves_summary
from rfiddesign.cli.survey import survey_lines, survey_of, survey_summary


def extras_of(folder: Path) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Their answers in a result folder, for machines by name and for people in lines."""
    told: dict[str, Any] = {}
    lines: list[str] = []
    survey, shelves = survey_of(folder), shelves_of(folder)
    if survey is not None:
        told["survey"] = survey_summary(survey)
        lines += survey_lines(survey)
    if shelves is not None:
        told["shelves"] = shelves_summary(shelves)
        lines += shelves_lines(shelves)
    return told, tuple(lines)
