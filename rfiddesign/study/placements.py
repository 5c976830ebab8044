"""Layouts that a study has the program place: from `[placements.NAME]` to readers under the robot."""

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from rfiddesign.catalog import antenna
from rfiddesign.errors import StudyError
from rfiddesign.geometry import ReaderLayout, make_pattern
from rfiddesign.optimize.reader_placement import Placement, PlacementLimits, PlacementProblem, place_readers, rivals
from rfiddesign.results.folder import PLACEMENTS, write_record
from rfiddesign.results.placements import MotionRecord, PlacementRecord, Placements
from rfiddesign.results.study_result import AntennaPose
from rfiddesign.study.checked import checked
from rfiddesign.study.config import StudyFile


def placement_problem(path: Path, file: StudyFile, name: str) -> PlacementProblem:
    """What `[placements.NAME]` asks; StudyError if that cannot be."""
    section = file.placements[name]

    def built() -> PlacementProblem:
        pattern = make_pattern(
            section.pattern, tags_per_m2=section.tags_per_m2, pitch_mm=section.pitch_mm, seed=file.seed
        )
        return PlacementProblem(
            antenna(section.antenna),
            pattern,
            section.distance_mm,
            file.robot.footprint_radius_mm,
            section.n_reads,
            tuple(section.motions),
            section.is_one_dead,
            section.grid_mm,
            tuple(tuple(box) for box in section.keep_outs_mm),
            section.turn_deg,
        )

    return checked(path, f"placements.{name}", built)


def placement(path: Path, file: StudyFile, name: str) -> Placement:
    """Readers as `[placements.NAME]` asks for them, under that name; worked out once in a session."""
    section = file.placements[name]
    limits = PlacementLimits(allowed_share=section.allowed_share)
    problem = placement_problem(path, file, name)
    found = checked(path, f"placements.{name}", lambda: _placed(problem, section.n_readers, limits))
    return replace(found, layout=replace(found.layout, name=name))


def placed_layout(path: Path, file: StudyFile, name: str) -> ReaderLayout:
    """The layout of a placement."""
    return placement(path, file, name).layout


def searched_placements(file: StudyFile) -> tuple[str, ...]:
    """Names of the placements that stand in the space."""
    listed = [] if file.space is None else file.space.layout
    return tuple(name for name in listed if name in file.placements)


def placements_record(path: Path, file: StudyFile, names: Iterable[str]) -> Placements:
    """The placements of those names, as data."""
    return Placements(placements=[_record(name, placement(path, file, name)) for name in names])


def save_placements(path: Path, file: StudyFile, names: tuple[str, ...], folder: Path) -> None:
    """Write placements.json into a folder, which is made if need be; StudyError if it cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_record(folder / PLACEMENTS, placements_record(path, file, names))
    except OSError as error:
        raise StudyError(f"cannot be written: {error.strerror}", file=folder) from None


def place_readers_of(path: Path, file: StudyFile, only: str | None = None) -> dict[str, Any]:
    """All placements of a study, or only one of them, beside what usual shapes need; as plain data.

    Raises
    ------
    StudyError : if there is none, or one cannot be.
    """
    names = list(file.placements)
    if not names:
        raise StudyError("is missing: it says what readers are to be placed for", file=path, key="placements")
    if only is not None and only not in names:
        raise StudyError(f"found {only!r}, must be one of {', '.join(names)}", file="--name")
    chosen = [only] if only is not None else names
    found = placements_record(path, file, chosen)
    return {
        each.name: each.model_dump(mode="json")
        | {
            "toml": _toml(each),
            "rivals": [
                {"shape": rival.shape, "n_readers": rival.n_readers, "is_guaranteed": rival.is_guaranteed}
                for rival in rivals(placement_problem(path, file, each.name))
            ],
        }
        for each in found.placements
    }


@cache
def _placed(problem: PlacementProblem, n_readers: int | None, limits: PlacementLimits) -> Placement:
    return place_readers(problem, n_readers, limits)


def _toml(record: PlacementRecord) -> str:
    """The layout as a study file may list it."""
    poses = ", ".join(f"[{pose.x_mm:g}, {pose.y_mm:g}]" for pose in record.antennas)
    return f'[layouts.placed-{record.n_readers}]\nkind = "list"\nposes = [{poses}]'


def _record(name: str, found: Placement) -> PlacementRecord:
    problem = found.problem
    return PlacementRecord(
        name=name,
        antenna=problem.antenna.name,
        antenna_housing_mm=problem.antenna.housing_mm,
        pattern=problem.pattern.name,
        tags_per_m2=problem.pattern.tags_per_m2,
        basis_mm=tuple(tuple(vector) for vector in problem.basis.tolist()),
        footprint_radius_mm=problem.footprint_radius_mm,
        distance_mm=problem.distance_mm,
        n_reads=problem.n_reads,
        is_one_dead=problem.is_one_dead,
        grid_mm=problem.grid_mm,
        antennas=[AntennaPose(x_mm=x, y_mm=y, yaw_rad=yaw) for x, y, yaw in found.layout.poses],
        lower_bound=found.lower_bound,
        bound_by=found.bound_by,
        is_proved=found.is_proved,
        is_number_given=found.is_number_given,
        is_guaranteed=found.is_guaranteed,
        gap=found.gap,
        method=found.method,
        checks=[
            MotionRecord(
                motion=check.motion,
                unserved_share=check.unserved_share,
                undecided_share=check.undecided_share,
                sampled_unserved_share=check.sampled_unserved_share,
                worst=round(check.worst, 3),
                unit=check.unit,
                is_guaranteed=check.is_guaranteed,
            )
            for check in found.checks
        ],
    )
