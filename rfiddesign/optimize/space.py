"""The space of designs: every combination of its variables' values, less what cannot be built."""

from dataclasses import dataclass
from itertools import product

from shapely.geometry import Polygon

from rfiddesign.catalog import Antenna
from rfiddesign.design import Design, check_design
from rfiddesign.geometry import ReaderLayout, TagPattern

MAX_DESIGNS = 1_000_000


@dataclass(frozen=True)
class Space:
    """Values of each variable of a design."""

    layouts: tuple[ReaderLayout, ...]
    antennas: tuple[Antenna, ...]
    patterns: tuple[TagPattern, ...]

    def __post_init__(self) -> None:
        if not self.size:
            raise ValueError("space is empty, every variable needs at least one value")
        if self.size > MAX_DESIGNS:
            raise ValueError(f"space has {self.size:,} designs, at most {MAX_DESIGNS:,} are allowed")

    @property
    def size(self) -> int:
        """Number of combinations."""
        return len(self.layouts) * len(self.antennas) * len(self.patterns)

    def designs(self) -> tuple[Design, ...]:
        """Every combination; a design's place in this order is its number in the study."""
        return tuple(Design(*values) for values in product(self.layouts, self.antennas, self.patterns))


@dataclass(frozen=True)
class Unbuildable:
    """A layout that does not take an antenna, with the reason."""

    layout_name: str
    antenna_name: str
    reason: str


def unbuildable(space: Space, footprint: Polygon) -> tuple[Unbuildable, ...]:
    """The pairs of layout and antenna of a space that overlap or do not fit under the robot."""
    rejected = []
    for layout, antenna in product(space.layouts, space.antennas):
        try:
            check_design(Design(layout, antenna, space.patterns[0]), footprint)
        except ValueError as error:
            rejected.append(Unbuildable(layout.name, antenna.name, str(error)))
    return tuple(rejected)
