"""Readers that a study had placed, as data: what `placements.json` holds."""

from rfiddesign.results.study_result import AntennaPose, Record


class MotionRecord(Record):
    """What the recheck of one motion found: shares of all phases and headings, and the longest way to the reads."""

    motion: str
    unserved_share: float
    undecided_share: float
    sampled_unserved_share: float
    worst: float
    unit: str
    is_guaranteed: bool


class PlacementRecord(Record):
    """A placed layout, what it was placed for, and how good it is."""

    name: str
    antenna: str
    antenna_housing_mm: tuple[float, float]
    pattern: str
    tags_per_m2: float
    basis_mm: tuple[tuple[float, float], tuple[float, float]]
    footprint_radius_mm: float
    distance_mm: float
    n_reads: int
    is_one_dead: bool
    grid_mm: float
    antennas: list[AntennaPose]
    lower_bound: int
    bound_by: str
    is_proved: bool
    is_number_given: bool
    is_guaranteed: bool
    gap: float
    method: str
    checks: list[MotionRecord]

    @property
    def n_readers(self) -> int:
        """Number of readers."""
        return len(self.antennas)


class Placements(Record):
    """All that a study had placed."""

    placements: list[PlacementRecord]
