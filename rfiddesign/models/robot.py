"""What an estimator is told of the robot it runs on."""

from dataclasses import dataclass, field

from rfiddesign.design import Design
from rfiddesign.geometry import DetectionArea, ReaderLayout
from rfiddesign.models.reads import ReadModel


@dataclass(frozen=True)
class Robot:
    """A robot's antennas and how they read.

    Parameters
    ----------
    layout : where the antennas sit.
    area : what each sees of the floor.
    rssi_radii_mm : radius within which the signal reaches each step of RSSI, falling, the first that of the area; empty
        if reads have no RSSI.
    reads : how the readers read, as the estimator believes; its `delay_s` is taken off the age of reads.
    """

    layout: ReaderLayout
    area: DetectionArea
    rssi_radii_mm: tuple[float, ...] = ()
    reads: ReadModel = field(default_factory=ReadModel)

    @classmethod
    def of(cls, design: Design, reads: ReadModel) -> "Robot":
        """The robot of a design."""
        return cls(design.layout, design.antenna.area, design.antenna.rssi_radii_mm, reads)
