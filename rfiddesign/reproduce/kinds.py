"""Kinds of reproduction: what their study files may say, and how they are measured."""

from typing import Protocol

from rfiddesign.reproduce import floor_systems, snapshots, tag_mapping
from rfiddesign.reproduce.config import FLOOR, ReproductionHead
from rfiddesign.reproduce.measured import Measured
from rfiddesign.reproduce.progress import OnProgress
from rfiddesign.reproduce.reproduction import Reproduction


class Kind(Protocol):
    """What the module of every kind offers."""

    File: type[ReproductionHead]

    def prepared(self, loaded: Reproduction) -> Reproduction:
        """The reproduction ready to be measured; StudyError for what its types alone do not tell to be wrong."""

    def measure(
        self, loaded: Reproduction, n_workers: int | None, on_progress: OnProgress, *, is_quick: bool
    ) -> Measured:
        """Every number, published or not, the figures and what else is worth keeping."""


KINDS: dict[str, Kind] = {
    FLOOR: floor_systems,
    snapshots.config.KIND: snapshots,
    tag_mapping.config.KIND: tag_mapping,
}
