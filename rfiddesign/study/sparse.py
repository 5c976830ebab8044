"""The sparsest rows of tags for the robot of a study's design."""

from typing import Any

from rfiddesign.errors import StudyError
from rfiddesign.geometry import Disc, make_pattern
from rfiddesign.optimize.reader_placement import Drive, PlacementProblem, sparsest_patterns
from rfiddesign.study.commands import buildable_design
from rfiddesign.study.load import Study


def sparsest_of_study(study: Study, drive: tuple[float, float, float], step_mm: float) -> dict[str, Any]:
    """The sparsest square, triangular and staggered rows that the design at hand reads in time, as plain data.

    Parameters
    ----------
    drive : distance before a read has come [mm], speed [mm/s], and the time that a read takes [s].

    Raises
    ------
    StudyError : if the design cannot be built, or cannot be asked this.
    """
    design = buildable_design(study)
    try:
        if any(yaw for _, _, yaw in design.layout.poses) and not isinstance(design.antenna.area, Disc):
            raise ValueError(f"layout = {design.layout.name}: has antennas that are turned")
        any_pattern = make_pattern("square", pitch_mm=1000.0)
        problem = PlacementProblem(design.antenna, any_pattern, drive[0], study.file.robot.footprint_radius_mm)
        found = sparsest_patterns(problem, design.layout, Drive(*drive), step_mm)
    except ValueError as error:
        raise StudyError(str(error), file=study.path, key="design") from None
    return {
        "layout": design.layout.name,
        "n_readers": design.layout.n_readers,
        "antenna": design.antenna.name,
        "distance_mm": drive[0],
        "speed_mm_per_s": drive[1],
        "read_time_s": drive[2],
        "patterns": [
            {
                "family": one.family,
                "is_found": one.pattern is not None,
                "pitch_mm": round(one.pitch_mm, 3),
                "row_spacing_mm": round(one.row_spacing_mm, 3),
                "stagger_mm": round(one.stagger * one.pitch_mm, 3),
                "tags_per_m2": round(one.pattern.tags_per_m2, 4) if one.pattern else None,
                "n_tried": one.n_tried,
            }
            for one in found
        ],
    }
