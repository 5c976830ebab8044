"""From one design and its runs to the records that are saved: antennas, what they see, errors over time."""

import math
from collections.abc import Iterable

from rfiddesign.design import Design
from rfiddesign.geometry import (
    Aliasing,
    PlacedPattern,
    aliased_headings,
    blind_corridors,
    blind_distances,
    coverage_on_way,
    pattern_beneath,
)
from rfiddesign.results import study_result as records
from rfiddesign.simulation.run import Trace

BLIND_LIMIT_MM = 500.0
# More digits than any result has, fewer than where compilers differ.
SIGNIFICANT_DIGITS = 9
# A point every half second is all that a curve shows.
TRACE_STEP_S = 0.5


def antenna_poses(design: Design) -> list[records.AntennaPose]:
    """Where each antenna sits on the robot."""
    return [
        records.AntennaPose(x_mm=rounded(x), y_mm=rounded(y), yaw_rad=rounded(yaw)) for x, y, yaw in design.layout.poses
    ]


def blind_records(design: Design) -> tuple[tuple[Aliasing, ...], tuple[Aliasing, ...]]:
    """Lanes never read that another spacing of the antennas would close, and lanes for which there are too few.

    None where tags were placed one by one along routes: their lanes do not go on for ever.
    """
    if isinstance(design.pattern, PlacedPattern):
        return (), ()
    seen = (design.layout, design.antenna.area, pattern_beneath(design.pattern))
    return aliased_headings(*seen, limit_mm=BLIND_LIMIT_MM), blind_corridors(*seen, limit_mm=BLIND_LIMIT_MM)


def coverage_record(design: Design, blind: tuple[Aliasing, ...]) -> records.CoverageRecord:
    """What the antennas of a design see of its tags, with a warning for each of its blind lanes."""
    seen = (design.layout, design.antenna.area, pattern_beneath(design.pattern))
    total = coverage_on_way(*seen)
    drives = () if isinstance(design.pattern, PlacedPattern) else blind_distances(*seen, limit_mm=BLIND_LIMIT_MM)
    return records.CoverageRecord(
        k_coverage=[rounded(share) for share in total.k_coverage],
        expected_reads=rounded(total.expected_reads),
        two_tags_share=rounded(total.two_tags_share),
        method=total.method,
        stderr=rounded(total.stderr),
        drives=[
            records.DriveRecord(
                heading_deg=rounded(drive.heading_deg),
                mean_mm=rounded(drive.mean_mm),
                p95_mm=rounded(drive.p95_mm),
                max_mm=rounded(drive.max_mm),
                share_over_limit=rounded(drive.share_over_limit),
                is_aligned=drive.is_aligned,
            )
            for drive in drives
        ],
        warnings=[found.message for found in blind],
    )


def coverage_in_full(design: Design) -> records.CoverageRecord:
    """`coverage_record` with all blind lanes."""
    aliased, corridors = blind_records(design)
    return coverage_record(design, (*aliased, *corridors))


def traces_record(traces: Iterable[tuple[int, int, Trace]]) -> list[records.TraceRecord]:
    """Errors over time of runs given as (robots of the fleet, run number, trace), thinned to what a curve shows."""
    found = []
    for n_robots, run, trace in traces:
        every = max(1, round(TRACE_STEP_S / trace.dt_s))
        steps = range(every - 1, trace.position_error_mm.size, every)
        found.append(
            records.TraceRecord(
                n_robots=n_robots,
                run=run,
                time_s=[rounded((step + 1) * trace.dt_s) for step in steps],
                position_error_mm=[rounded(trace.position_error_mm[step]) for step in steps],
                heading_error_rad=[rounded(trace.heading_error_rad[step]) for step in steps],
            )
        )
    return found


def about(value: float) -> float:
    """A number to as many digits as one has who counts by rule of thumb, or measures on a busy machine: three."""
    return float(f"{value:.3g}")


def rounded(value: float) -> float:
    """A number to nine significant digits."""
    return float(f"{value:.{SIGNIFICANT_DIGITS}g}") if math.isfinite(value) else value
