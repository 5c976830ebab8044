"""What `rfiddesign run` tells of an as-built survey."""

from pathlib import Path
from typing import Any

from rfiddesign.results.folder import SURVEY, read_record
from rfiddesign.results.survey import Mistakes, SurveyedFloor, SurveyRecord
from rfiddesign.units import money


def survey_of(folder: Path) -> SurveyRecord | None:
    """The surveys in a result folder; None if its study asked for none."""
    return read_record(folder / SURVEY, SurveyRecord) if (folder / SURVEY).exists() else None


def survey_summary(record: SurveyRecord) -> dict[str, Any]:
    """The surveys in short, floor by floor: advice, residual, errors with each map, mistakes found."""
    kept = (
        "installation_error_mm", "is_recorded", "advice", "reasons", "before", "after", "calibration",
        "mean_correction_mm", "sigma_mm", "n_unknown", "laid_mm", "scatter_mm", "is_as_declared", "dead", "swapped",
        "misplaced", "dead_counts", "swapped_counts", "maps", "gain_mm", "denser", "cheapest_denser",
    )  # fmt: skip
    floors = [floor.model_dump(mode="json", include=set(kept)) for floor in record.floors]
    return {"cost_cents": record.cost_cents, "hours": record.hours, "driven_m": record.driven_m, "floors": floors}


def survey_lines(record: SurveyRecord) -> list[str]:
    """A line of advice for each installation error, its reasons, and what the survey found."""
    of = " of recorded stretches" if record.floors[0].is_recorded else ""
    lines = ["", f"as-built survey: {money(record.cost_cents, record.currency)}, {record.hours:.1f} h{of}"]
    for floor in record.floors:
        lines.append(f"  laid to {floor.installation_error_mm:g} mm: {floor.advice}")
        lines += [f"    {reason}" for reason in floor.reasons]
        lines.append(f"    {_found(floor)}")
    return lines


def _found(floor: SurveyedFloor) -> str:
    words = f"mean correction {floor.mean_correction_mm:.1f} mm"
    if floor.after is not None:
        words += (
            f"; residual {floor.after.per_axis_rms_mm:.1f} mm per axis, {floor.after.radial_rms_mm:.1f} mm in distance"
            " (root mean squares)"
        )
    dead, swapped = _of(floor.dead_counts, "dead tags"), _of(floor.swapped_counts, "swapped pairs")
    return f"{words}; {dead}; {swapped}"


def _of(found: Mistakes, what: str) -> str:
    if found.n_true is None:
        return f"{found.n_found} {what}"
    alarms = f", {found.n_false} false" if found.n_false else ""
    return f"{found.n_found} of {found.n_true} {what} found{alarms}"
