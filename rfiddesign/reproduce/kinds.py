"""Kinds of reproduction: what their study files may say, and how they are measured."""

from typing import Protocol

from matplotlib.figure import Figure

from rfiddesign.reproduce import floor_systems, snapshots, tag_mapping
from rfiddesign.reproduce.config import FLOOR, ReproductionHead
from rfiddesign.reproduce.progress import OnProgress
from rfiddesign.reproduce.reproduction import Reproduction
from rfiddesign.reproduce.rows import Row


class Kind(Protocol):
    """What the module of every kind offers."""

    File: type[ReproductionHead]

    def prepared(self, loaded: Reproduction) -> Reproduction:
        """The reproduction ready to be measured; StudyError for what its types alone do not tell to be wrong."""

    def measure(
        self, loaded: Reproduction, n_workers: int | None, on_progress: OnProgress, *, is_quick: bool
    ) -> tuple[list[Row], dict[str, Figure]]:
        """Every number, published or not, and the figures by name."""


KINDS: dict[str, Kind] = {
    FLOOR: floor_systems,
    snapshots.config.KIND: snapshots,
    tag_mapping.config.KIND: tag_mapping,
}
