"""The filter of a study's design as source code for the robot."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from rfiddesign.errors import StudyError
from rfiddesign.estimators.portable import Words, c_source
from rfiddesign.floor import build_tag_map
from rfiddesign.results.folder import write_text
from rfiddesign.simulation.run import prepare
from rfiddesign.study.commands import buildable_design
from rfiddesign.study.load import Study, check_tag_count, floor_of, scenario_of

ESTIMATOR = "pmg"
FILE_NAME = "rfid_pmg.c"


def export_estimator(study: Study, out: Path) -> dict[str, Any]:
    """Write the projected-moment Gaussian filter of the study's design at hand, whatever filter the study names.

    Parameters
    ----------
    out : the file, or the folder that gets `rfid_pmg.c`.

    Returns
    -------
    What was written, as plain data that prints as JSON.

    Raises
    ------
    StudyError : if the study is at fault, or its map is too large for a file.
    """
    path = out / FILE_NAME if out.is_dir() else out
    if not path.parent.is_dir():
        raise StudyError("is no folder to write to", file=path.parent)
    study = replace(study, file=study.file.model_copy(update={"estimator": ESTIMATOR}))
    design = buildable_design(study)
    floor = floor_of(study)
    check_tag_count(study, design.pattern, floor, "design.tags_per_m2")
    ready = prepare(design, scenario_of(study, floor)).ready
    tags = build_tag_map(design.pattern.lay(floor.drivable))
    words = Words(study.name, study.file.title, design.name, floor.navigable_bounds)
    try:
        portable = c_source(ready, tags, words)
    except ValueError as error:
        raise StudyError(str(error), file=study.path, key="design") from None
    write_text(path, portable.text)
    return {
        "file": str(path),
        "estimator": ESTIMATOR,
        "design": design.name,
        "n_antennas": ready.n_antennas,
        "n_tags": portable.n_tags,
        "table_bytes": portable.table_bytes,
        "state_bytes": portable.state_bytes,
    }
