"""The space of designs: every combination of its variables' values, less what cannot be built.

Where a study leaves the estimator open, each design stands in the space once with each estimator: a candidate is a pair
of both.  The estimator costs nothing but computing time, so that the candidates of a design have one price.
"""

from dataclasses import dataclass, field
from itertools import product

from shapely.geometry import Polygon

from rfiddesign.catalog import USUAL_READER, Antenna, Reader, reader
from rfiddesign.design import Design, check_design, check_tag_spacing
from rfiddesign.geometry import ReaderLayout, TagPattern

MAX_DESIGNS = 1_000_000


@dataclass(frozen=True)
class Space:
    """Values of each variable of a design, the reader of all, and names of estimators, the preferred one first."""

    layouts: tuple[ReaderLayout, ...]
    antennas: tuple[Antenna, ...]
    patterns: tuple[TagPattern, ...]
    reader: Reader = field(default_factory=lambda: reader(USUAL_READER))
    estimators: tuple[str, ...] = ("mcl",)

    def __post_init__(self) -> None:
        if not self.size:
            raise ValueError("space is empty, every variable needs at least one value")
        if self.size > MAX_DESIGNS:
            raise ValueError(f"space has {self.size:,} designs, at most {MAX_DESIGNS:,} are allowed")

    @property
    def size(self) -> int:
        """Number of combinations."""
        return len(self.layouts) * len(self.antennas) * len(self.patterns) * len(self.estimators)

    def designs(self) -> tuple[Design, ...]:
        """Every design, whatever the estimator."""
        return tuple(Design(*values, self.reader) for values in product(self.layouts, self.antennas, self.patterns))

    def candidates(self) -> tuple[tuple[Design, str], ...]:
        """Every design with every estimator's name; its place in this order, estimators fastest, is its number."""
        return tuple((design, estimator) for design in self.designs() for estimator in self.estimators)


@dataclass(frozen=True)
class Unbuildable:
    """A layout that does not take an antenna, or an antenna that sees too much of a pattern, with the reason.

    Parameters
    ----------
    layout_name, antenna_name : what does not go together; "any layout" where the pattern is at fault.
    reason : why, in words.
    numbers : numbers of the candidates in the space that this rules out and no fault before it does.
    """

    layout_name: str
    antenna_name: str
    reason: str
    numbers: frozenset[int]


#: Stands for the layout where antenna and pattern are at fault.
ANY_LAYOUT = "any layout"


def unbuildable(space: Space, footprint: Polygon) -> tuple[Unbuildable, ...]:
    """What of a space cannot be built.

    Pairs of layout and antenna that overlap or do not fit under the robot; then pairs of antenna and pattern whose
    reader would see two tags at once and must not.
    """
    rejected, taken = [], set()
    n_antennas, n_patterns, n_estimators = len(space.antennas), len(space.patterns), len(space.estimators)

    def reject(layout_name: str, antenna_name: str, error: ValueError, numbers: set[int]) -> None:
        new = frozenset(numbers - taken)
        taken.update(new)
        ruled_out = frozenset(place * n_estimators + i for place in new for i in range(n_estimators))
        rejected.append(Unbuildable(layout_name, antenna_name, str(error), ruled_out))

    for (i, layout), (j, antenna) in product(enumerate(space.layouts), enumerate(space.antennas)):
        try:
            check_design(Design(layout, antenna, space.patterns[0], space.reader), footprint)
        except ValueError as error:
            first = (i * n_antennas + j) * n_patterns
            reject(layout.name, antenna.name, error, set(range(first, first + n_patterns)))
    for (j, antenna), (k, pattern) in product(enumerate(space.antennas), enumerate(space.patterns)):
        try:
            check_tag_spacing(Design(space.layouts[0], antenna, pattern, space.reader))
        except ValueError as error:
            numbers = {(i * n_antennas + j) * n_patterns + k for i in range(len(space.layouts))}
            reject(ANY_LAYOUT, antenna.name, error, numbers)
    return tuple(rejected)
