"""What a report says of the readers that the program placed; nothing if it placed none."""

from collections.abc import Iterator
from pathlib import Path

from rfiddesign.report.album import Picture
from rfiddesign.report.contents import Contents
from rfiddesign.report.extra import Extra
from rfiddesign.report.figures.placement import placement_figure
from rfiddesign.report.markup import drawn_into
from rfiddesign.report.tables import Table
from rfiddesign.report.words import percent
from rfiddesign.results.folder import PLACEMENTS, read_record
from rfiddesign.results.placements import MotionRecord, PlacementRecord, Placements


def placement_pictures(folder: Path) -> Iterator[Picture]:
    """A picture of each placed layout."""
    for number, record in enumerate(_read(folder), start=1):
        yield Picture("placements", f"placement-{number}", f"{record.name}: {asked(record)}.", placement_figure(record))


def placements_extra(contents: Contents) -> Extra | None:
    """The section on placed readers; None where none were."""
    table = placement_table(contents.folder)
    if table is None:
        return None
    pictures = tuple(placement_pictures(contents.folder))
    return Extra("placements", "Readers placed", "placements.html.jinja", table, pictures)


def draw_placements(folder: Path) -> None:
    """Draw a picture of each placed layout into a folder that holds `placements.json`."""
    for picture in placement_pictures(folder):
        drawn_into(folder, picture)


def placement_table(folder: Path) -> Table | None:
    """Each placed layout with its bound and what the recheck found."""
    records = _read(folder)
    if not records:
        return None
    headers = ("layout", "asked", "readers", "at least", "proved fewest", "recheck")
    rows = tuple(
        (
            record.name,
            asked(record),
            str(record.n_readers),
            f"{record.lower_bound} ({record.bound_by})",
            "yes" if record.is_proved else "number given" if record.is_number_given else "no",
            "; ".join(_checked(check) for check in record.checks),
        )
        for record in records
    )
    return Table(headers, rows, (2,))


def asked(record: PlacementRecord) -> str:
    """What a layout was placed for, in words."""
    reads = "a read" if record.n_reads == 1 else f"reads by {record.n_reads} readers"
    dead = ", any one reader dead" if record.is_one_dead else ""
    motions = " and ".join(check.motion for check in record.checks)
    return (
        f"{record.antenna} mm antennas over {record.pattern} tags, {record.tags_per_m2:.3g} per m²: {reads} within"
        f" {record.distance_mm:g} mm, {motions}{dead}"
    )


def _checked(check: MotionRecord) -> str:
    if check.is_guaranteed:
        return f"{check.motion}: guaranteed, {_worst(check)}"
    if check.unserved_share or check.sampled_unserved_share:
        share = max(check.unserved_share, check.sampled_unserved_share)
        return f"{check.motion}: {percent(share)} of places and headings without, {_worst(check)}"
    return f"{check.motion}: none found without, but not proved, {_worst(check)}"


def _worst(check: MotionRecord) -> str:
    return f"longest {check.worst:.0f} {check.unit} found"


def _read(folder: Path) -> list[PlacementRecord]:
    path = folder / PLACEMENTS
    return read_record(path, Placements).placements if path.exists() else []
