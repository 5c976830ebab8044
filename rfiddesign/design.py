"""A design: what is bolted under each robot and what is laid into the floor."""

from dataclasses import dataclass, field

import shapely
from scipy.spatial.distance import pdist
from shapely.geometry import Polygon

from rfiddesign.catalog import USUAL_READER, Antenna, Reader, reader
from rfiddesign.geometry import DetectionArea, Disc, ReaderLayout, TagPattern, check_layout


@dataclass(frozen=True)
class Design:
    """A thing to buy: readers on the robot and tags in the floor.

    Parameters
    ----------
    layout : where the antennas sit on the robot; one reader per antenna.
    antenna : the antenna of every reader.
    pattern : the tags' pattern.
    reader : the readers.
    """

    layout: ReaderLayout
    antenna: Antenna
    pattern: TagPattern
    reader: Reader = field(default_factory=lambda: reader(USUAL_READER))

    @property
    def name(self) -> str:
        """One line that names the design, as "cross-8, 60x60, square, 100 tags/m2"."""
        return f"{self.layout.name}, {self.antenna.name}, {self.pattern.name}, {self.pattern.tags_per_m2:g} tags/m2"


def check_design(design: Design, footprint: Polygon) -> None:
    """Raise ValueError, naming the antennas, if they overlap or stick out of the robot's footprint."""
    check_layout(design.layout, design.antenna.outline(), footprint)


def check_tag_spacing(design: Design) -> None:
    """Raise ValueError, with both lengths, if a reader that must see one tag only may get two into its field.

    Two tags can be in the field at once where they lie closer than its widest extent, for some pose of the robot; where
    the plan has the tags, not where an installer leaves them.
    """
    if not design.reader.sees_one_tag_only:
        return
    span, distance = span_mm(design.antenna.area), design.pattern.min_distance_mm
    if distance < span:
        raise ValueError(
            f"reader {design.reader.name} must never see two tags at once; antenna {design.antenna.name} sees tags up"
            f" to {span:.4g} mm apart, those of pattern {design.pattern.name} with"
            f" {design.pattern.tags_per_m2:.4g} tags/m2 lie {distance:.4g} mm apart"
        )


def span_mm(area: DetectionArea) -> float:
    """Largest distance [mm] between two points of an area."""
    if isinstance(area, Disc):
        return 2.0 * area.radius_mm
    return float(pdist(shapely.get_coordinates(area.outline().convex_hull)).max())
