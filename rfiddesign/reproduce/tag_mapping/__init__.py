"""A kind of reproduction: tags mapped by robots whose poses are known (tag_mapping_adaptive_likelihood)."""

from rfiddesign.errors import StudyError
from rfiddesign.reproduce.measured import Measured
from rfiddesign.reproduce.progress import OnProgress
from rfiddesign.reproduce.reproduction import Reproduction
from rfiddesign.reproduce.tag_mapping import figures, line, models, office
from rfiddesign.reproduce.tag_mapping.config import TagMappingFile
from rfiddesign.results.mapped_tags import mapped_tags_csv
from rfiddesign.study.checked import checked

__all__ = ["File", "measure", "prepared"]

File = TagMappingFile
#: Tags of the office's first drive.
TAG_MAP = "tag_map.csv"


def prepared(loaded: Reproduction) -> Reproduction:
    """The reproduction as it is; StudyError for models that cannot be built."""
    file = loaded.file
    for key, field in (("office.paper", file.office.paper), ("office.uhf", file.office.uhf)):
        try:
            mapping = models.fitted(file.mapping, field)
            models.papers_models(mapping)
            models.field_models(mapping, models.lobes(mapping, field)[1])
        except ValueError as error:
            raise StudyError(str(error), file=loaded.path, key=key) from None
    return loaded


def measure(loaded: Reproduction, n_workers: int | None, on_progress: OnProgress, *, is_quick: bool) -> Measured:
    """The line experiments and the office; see `kinds.Kind`.

    Raises
    ------
    StudyError : if more tags are near the robot of the office than can be listed.
    """
    file, published = loaded.file, loaded.expected.published
    rows = line.measure(file, published, n_workers, on_progress, is_quick=is_quick)
    more, runs = checked(
        loaded.path, "office", lambda: office.measure(file, published, n_workers, on_progress, is_quick=is_quick)
    )
    drawn = {
        "line": figures.line_figure(file),
        "posterior": figures.posterior_figure(file),
        "office": figures.office_figure(file, runs),
    }
    tag_map = office.first_map(file, is_quick=is_quick)
    return Measured([*rows, *more], drawn, {TAG_MAP: mapped_tags_csv(tag_map)})
