"""What as-built surveys of a floor found, and drives with the maps that follow."""

from dataclasses import dataclass

import numpy as np

from rfiddesign.cost import Cost
from rfiddesign.design import Design
from rfiddesign.estimators.tag_mapping.survey import SurveyedTags
from rfiddesign.metrics import RunMetrics
from rfiddesign.simulation.as_built import LaidFloor
from rfiddesign.study.candidates import Candidate
from rfiddesign.study.pipeline import Answer


@dataclass(frozen=True, eq=False)
class Drives:
    """Runs with one map: its name, what the filter is told of it (None: nothing), tags on it, what runs measured."""

    name: str
    sigma_mm: float | None
    n_tags: int
    runs: list[RunMetrics]

    @property
    def errors_mm(self) -> np.ndarray:
        """Mean position error of each run [mm]."""
        return np.array([run.position_mean_mm for run in self.runs])


@dataclass(frozen=True, eq=False)
class Denser:
    """A denser floor, what it costs more, and drives with its dead and swapped tags known, which is not charged."""

    design: Design
    n_tags: int
    extra_cents: int
    drives: Drives
    reaches: bool


@dataclass(frozen=True, eq=False)
class FloorFound:
    """One floor as laid, what its survey found (in all and after the first passes), and drives with each map."""

    installation_mm: float
    laid: LaidFloor
    is_recorded: bool
    surveyed: SurveyedTags
    early: SurveyedTags | None
    maps: tuple[Drives, ...]
    denser: tuple[Denser, ...]

    def drives(self, name: str) -> Drives:
        """The drives with the map of that name."""
        return next(drives for drives in self.maps if drives.name == name)


@dataclass(frozen=True, eq=False)
class SurveyFound:
    """The surveys of a study: for which answer and candidate, what one takes and costs, and floor by floor.

    `hours` are those of a simulated survey with its turns and ways between lanes; of a recorded log the sum of its
    stretches.
    """

    answer: Answer
    candidate: Candidate
    hours: float
    driven_m: float
    n_lanes: int
    cost: Cost
    floors: tuple[FloorFound, ...]
