"""The hall of a study with shelves."""

from pathlib import Path

from rfiddesign.floor.scene import Scene
from rfiddesign.floor.scenes import warehouse
from rfiddesign.study.checked import checked
from rfiddesign.study.config import StudyFile


def hall_of(path: Path, file: StudyFile, tags_per_m: float | None = None) -> Scene:
    """The hall with so many tags per metre of shelf front, the first density of the space unless given.

    Raises
    ------
    StudyError : if no row of shelves fits or there would be too many tags.
    """
    section, (length_m, width_m) = file.shelves, file.floor.rectangle_m
    density = section.space.tags_per_m[0] if tags_per_m is None else tags_per_m
    return checked(
        path,
        "shelves",
        lambda: warehouse(
            1e3 * length_m, 1e3 * width_m, aisle_mm=section.aisle_mm, shelf_depth_mm=section.depth_mm,
            tags_per_m=density, footprint_mm=file.robot.footprint_radius_mm, heights=tuple(section.tag_heights_mm),
        ),
    )  # fmt: skip
