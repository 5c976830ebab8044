"""As-built surveys on a page: whether one pays, what it found, and drives with each map."""

from collections.abc import Iterator
from dataclasses import dataclass

from rfiddesign.report.album import Picture
from rfiddesign.report.contents import Contents
from rfiddesign.report.extra import Extra
from rfiddesign.report.figures.survey import errors_figure, places_figure, residuals_figure
from rfiddesign.report.tables import Table
from rfiddesign.report.words import count, grouped, percent
from rfiddesign.results.folder import SURVEY, read_record
from rfiddesign.results.study_result import MeanRecord
from rfiddesign.results.survey import Mistakes, SurveyedFloor, SurveyRecord
from rfiddesign.units import money

ERRORS, PLACES = "survey-errors", "survey-places"
#: Ids that a page lists of each kind.
MAX_IDS = 40
#: What each map is.
MAPS = {
    "nominal": "nominal: the plan",
    "checked": "checked: dead tags struck off, swapped ones put right, misplaced ones at the nearest planned place",
    "surveyed": "surveyed: places as found",
    "true": "true: places as they are",
}
DIRECTIONS = {"crossing": "along x and y in turn", "along x": "along x", "along y": "along y"}


@dataclass(frozen=True)
class FloorPart:
    """What the page says of one floor."""

    heading: str
    advice: str
    reasons: tuple[str, ...]
    maps: Table
    found: Table
    listed: tuple[str, ...]


@dataclass(frozen=True)
class SurveyPart:
    """What the page says of surveys."""

    driven: str
    reference: str
    cost: Table
    floors: tuple[FloorPart, ...]


def survey_extra(contents: Contents) -> Extra | None:
    """The section on surveys; None if the study asked for none."""
    if not (contents.folder / SURVEY).exists():
        return None
    record = read_record(contents.folder / SURVEY, SurveyRecord)
    return Extra("survey", "As-built survey", "survey.html.jinja", survey_part(record), tuple(survey_pictures(record)))


def survey_pictures(record: SurveyRecord) -> Iterator[Picture]:
    """The figures of a survey."""
    caption = (
        "Mean localization error by what is spent beyond the chosen design; bars are two standard errors. A survey pays"
        " where it lies below and to the left of the denser floors, whose dead and swapped tags are known, which is not"
        " charged."
    )
    yield Picture(ERRORS, "survey-errors", caption, errors_figure(record))
    if any(floor.after is not None for floor in record.floors):
        caption = "How far tags lie from where the nominal and the surveyed map have them."
        yield Picture(PLACES, "survey-residuals", caption, residuals_figure(record))
    for floor in record.floors:
        caption = f"Tags about the floor's middle, laid to {floor.installation_error_mm:g} mm per axis."
        yield Picture(PLACES, f"survey-places-{floor.installation_error_mm:g}mm", caption, places_figure(floor))


def survey_part(record: SurveyRecord) -> SurveyPart:
    """What the page says of surveys."""
    first = record.floors[0]
    if first.is_recorded:
        driven = (
            f"The floor of {record.design}, the answer for {count(record.n_robots, 'robot')}, was driven over along"
            f" {record.driven_m:,.0f} m in {record.hours:.1f} h of recorded stretches, time between them not counted."
            " Nobody knows where its tags lie in truth: drives are simulated over a floor drawn from what the survey"
            " says of each tag, so that the surveyed map is right by construction."
        )
    else:
        driven = (
            f"The floor of {record.design}, the answer for {count(record.n_robots, 'robot')}, is driven over"
            f" {record.passes:,} times {DIRECTIONS[record.directions]}, along"
            f" {count(record.n_lanes, 'lane')} of {record.driven_m:,.0f} m in all: {record.hours:.1f} h."
        )
    off = "taken to be off" if first.is_recorded else "off"
    reference = (
        f"The reference localizer is {off} by {record.pose_error_mm:g} mm per axis and {record.heading_error_deg:g}°"
        f" (standard deviations) and forgets its error in {record.correlation_s:g} s: one error shifts all that is read"
        " while the robot passes over a tag."
    )
    return SurveyPart(driven, reference, _cost(record), tuple(_floor(record, floor) for floor in record.floors))


def _cost(record: SurveyRecord) -> Table:
    rows = tuple(
        (line.item, f"{grouped(line.quantity)} {'' if line.unit == 'piece' else line.unit}".rstrip(),
         money(line.amount_cents, record.currency), line.source)
        for line in record.cost_lines
    )  # fmt: skip
    total = ("Total", "", money(record.cost_cents, record.currency), "")
    return Table(("Item", "Quantity", "Amount", "Source"), rows, (1, 2), total)


def _floor(record: SurveyRecord, floor: SurveyedFloor) -> FloorPart:
    verdict = {"pays": "the survey pays", "does not pay": "the survey does not pay"}.get(floor.advice)
    return FloorPart(
        heading=f"Tags laid to {floor.installation_error_mm:g} mm per axis: {verdict or 'the survey makes it worse'}",
        advice=floor.advice,
        reasons=tuple(floor.reasons),
        maps=_maps(record, floor),
        found=_found(floor),
        listed=_listed(floor),
    )


def _maps(record: SurveyRecord, floor: SurveyedFloor) -> Table:
    rows = [
        (
            MAPS[one.name], _plus_minus(one.position_mean_mm), _plus_minus(one.position_p95_mm),
            percent(one.pass_share.mean), _told(one.sigma_mm),
        )
        for one in floor.maps
    ]  # fmt: skip
    rows += [
        (f"mistakes known, {one.tags_per_m2:g} tags per m², {money(one.extra_cents, record.currency)} more",
         _plus_minus(one.position_mean_mm), "–", "–", _told(floor.map("checked").sigma_mm))
        for one in floor.denser
    ]  # fmt: skip
    headers = ("Map", "Mean error", "95th percentile", "Drives passed", "Filter is told")
    return Table(headers, tuple(rows), (1, 2, 3, 4))


def _told(sigma_mm: float | None) -> str:
    """What a filter is told of a map, if it can be told."""
    return "–" if sigma_mm is None else f"{sigma_mm:.1f} mm"


def _laid(floor: SurveyedFloor) -> str:
    least = 2.0 * floor.scatter_mm
    return f"{floor.laid_mm:.1f} mm" if floor.laid_mm > least else f"less than {least:.1f} mm"


def _found(floor: SurveyedFloor) -> Table:
    rows = [
        ("tags on the plan", f"{floor.n_tags:,}"),
        ("tags read", f"{floor.n_read:,}"),
        ("tags never read that may live", f"{floor.n_unseen:,}"),
        ("reads of ids that the plan does not have", f"{floor.n_unknown:,}"),
        ("reads of a tag, in how many visits", f"{floor.reads_per_tag:.0f} in {floor.visits_per_tag:.1f}"),
        ("mean correction of a place", f"{floor.mean_correction_mm:.1f} mm"),
        ("off the plan per axis, as reads have it", _laid(floor)),
        ("standard deviation per axis, as the survey says", f"{floor.sigma_mm:.1f} mm"),
    ]
    if floor.before is not None and floor.after is not None:
        for name, errors in (("before", floor.before), ("after (the residual)", floor.after)):
            rows.append((f"error per axis {name}", f"{errors.per_axis_rms_mm:.1f} mm"))
            rows.append((f"distance {name}, root mean square", f"{errors.radial_rms_mm:.1f} mm"))
        rows.append(("squared error over what the survey says, 2 if right", f"{floor.calibration:.2f}"))
    rows.append(("dead tags", _mistakes(floor.dead_counts)))
    rows.append(("swapped pairs", _mistakes(floor.swapped_counts)))
    for name, early in (("dead tags", floor.early_dead), ("swapped pairs", floor.early_swapped)):
        if early is not None:
            rows.append((f"{name} after the first two passes", _mistakes(early)))
    return Table(("Survey", "Value"), tuple(rows), (1,))


def _mistakes(found: Mistakes) -> str:
    if found.n_true is None:
        return f"{found.n_found} listed"
    return f"{found.n_found} of {found.n_true} found, {count(found.n_false, 'false alarm')}"


def _listed(floor: SurveyedFloor) -> tuple[str, ...]:
    """Ids of the tags that are not as planned."""
    pairs = [f"{i} and {j}" for i, j in floor.swapped]
    kinds = (
        ("Dead", [str(i) for i in floor.dead]),
        ("Swapped", pairs),
        ("Misplaced", [str(i) for i in floor.misplaced]),
    )
    found = []
    for name, ids in kinds:
        if ids:
            more = f" and {len(ids) - MAX_IDS} more" if len(ids) > MAX_IDS else ""
            found.append(f"{name}: {', '.join(ids[:MAX_IDS])}{more}.")
    return tuple(found)


def _plus_minus(mean: MeanRecord) -> str:
    return f"{mean.mean:.2f} mm" if mean.stderr is None else f"{mean.mean:.2f} ± {mean.stderr:.2f} mm"
