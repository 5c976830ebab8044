"""A design: what is bolted under each robot and what is laid into the floor."""

from dataclasses import dataclass

from shapely.geometry import Polygon

from rfiddesign.catalog import Antenna
from rfiddesign.geometry import ReaderLayout, TagPattern, check_layout


@dataclass(frozen=True)
class Design:
    """A thing to buy: readers on the robot and tags in the floor.

    Parameters
    ----------
    layout : where the antennas sit on the robot; one reader per antenna.
    antenna : the antenna of every reader.
    pattern : the tags' pattern.
    """

    layout: ReaderLayout
    antenna: Antenna
    pattern: TagPattern

    @property
    def name(self) -> str:
        """One line that names the design, as "cross-8, 60x60, square, 100 tags/m2"."""
        return f"{self.layout.name}, {self.antenna.name}, {self.pattern.name}, {self.pattern.tags_per_m2:g} tags/m2"


def check_design(design: Design, footprint: Polygon) -> None:
    """Raise ValueError, naming the antennas, if they overlap or stick out of the robot's footprint."""
    check_layout(design.layout, design.antenna.outline(), footprint)
