"""A proposal: values of variables made into a design, with the settings of its filter and its robots' speed."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from shapely.geometry import Polygon

from rfiddesign.catalog import USUAL_READER, Reader, antenna, reader
from rfiddesign.design import Design, check_design, check_tag_spacing
from rfiddesign.geometry import ReaderLayout, make_layout, make_pattern
from rfiddesign.optimize.explore.variables import KIND_VARIABLES, Value

#: What a layout's generator calls the number of readers.
_ARGUMENTS = {"readers": "n"}


@dataclass(frozen=True)
class Fixed:
    """What all proposals of a study share: readers, seed of random patterns, and its layouts by name."""

    reader: Reader = field(default_factory=lambda: reader(USUAL_READER))
    pattern_seed: int = 0
    layouts: Mapping[str, ReaderLayout] = field(default_factory=dict)


@dataclass(frozen=True)
class Proposal:
    """A design to try, with what else the exploration varies.

    Parameters
    ----------
    values : (name, value) of the variables it is made of.
    design : the design.
    estimator, n_particles, speed_mm_per_s : what is on the robots and how fast they drive; None: as the study has it.
    antenna_height_mm : of the design's antennas; None: as the catalog has it.
    """

    values: tuple[tuple[str, Value], ...]
    design: Design
    estimator: str | None = None
    n_particles: int | None = None
    speed_mm_per_s: float | None = None
    antenna_height_mm: float | None = None

    @cached_property
    def key(self) -> int:
        """A number from 0 to 2^63 - 1 that hangs on the values alone: proposals are the same where it is the same."""
        digest = hashlib.blake2b(repr(self.values).encode(), digest_size=8).digest()
        return int.from_bytes(digest, "big") >> 1

    @property
    def name(self) -> str:
        """One line that names it, as "bar-8-55, 60x60, square, 25 tags/m2, pmg, 200 mm/s"."""
        parts = [self.design.name]
        if self.antenna_height_mm is not None:
            parts.append(f"antennas {self.antenna_height_mm:g} mm high")
        if self.estimator is not None:
            parts.append(self.estimator)
        if self.n_particles is not None:
            parts.append(f"{self.n_particles} particles")
        if self.speed_mm_per_s is not None:
            parts.append(f"{self.speed_mm_per_s:g} mm/s")
        return ", ".join(parts)


def propose(values: tuple[tuple[str, Value], ...], fixed: Fixed) -> Proposal:
    """The proposal that values of variables make.

    Raises
    ------
    ValueError : if a value is one that no layout, antenna or pattern has.
    """
    given = dict(values)
    pattern = make_pattern(given["pattern"], tags_per_m2=given["tags_per_m2"], seed=fixed.pattern_seed)
    eye, height = antenna(given["antenna"]), given.get("antenna_height_mm")
    if height is not None:
        eye = eye.at_height(height)
    design = Design(_layout(given, fixed), eye, pattern, fixed.reader)
    others = (given.get(name) for name in ("estimator", "n_particles", "speed_mm_per_s", "antenna_height_mm"))
    return Proposal(values, design, *others)


def fault_of(proposal: Proposal, footprint: Polygon) -> str | None:
    """Why a proposal cannot be built under a robot of that footprint; None if it can."""
    try:
        check_design(proposal.design, footprint)
        check_tag_spacing(proposal.design)
    except ValueError as error:
        return str(error)
    return None


def _layout(given: Mapping[str, Value], fixed: Fixed) -> ReaderLayout:
    kind = given["kind"]
    if kind not in KIND_VARIABLES:
        return fixed.layouts[kind]
    parts = {name: given[name] for name in KIND_VARIABLES[kind]}
    layout = make_layout({"kind": kind} | {_ARGUMENTS.get(name, name): value for name, value in parts.items()})
    # A name says how many readers and, unlike the generators' own, how far apart.
    distances = [f"{value:g}" for name, value in parts.items() if name.endswith("_mm")]
    return replace(layout, name="-".join([layout.name, *distances]))
