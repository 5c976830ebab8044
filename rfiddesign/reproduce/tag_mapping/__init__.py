"""A kind of reproduction: tags mapped by robots whose poses are known (tag_mapping_adaptive_likelihood)."""

from matplotlib.figure import Figure

from rfiddesign.reproduce.progress import OnProgress
from rfiddesign.reproduce.reproduction import Reproduction
from rfiddesign.reproduce.rows import Row
from rfiddesign.reproduce.tag_mapping import config, figures, line, office
from rfiddesign.reproduce.tag_mapping.config import TagMappingFile

__all__ = ["File", "config", "measure", "prepared"]

File = TagMappingFile


def prepared(loaded: Reproduction) -> Reproduction:
    """The reproduction as it is: its types tell all that may be wrong."""
    return loaded


def measure(
    loaded: Reproduction, n_workers: int | None, on_progress: OnProgress, *, is_quick: bool
) -> tuple[list[Row], dict[str, Figure]]:
    """The line experiments and the office; see `kinds.Kind`."""
    file, published = loaded.file, loaded.expected.published
    rows = line.measure(file, published, n_workers, on_progress, is_quick=is_quick)
    more, runs = office.measure(file, published, n_workers, on_progress, is_quick=is_quick)
    return [*rows, *more], {
        "line": figures.line_figure(file),
        "posterior": figures.posterior_figure(file),
        "office": figures.office_figure(file, runs),
    }
