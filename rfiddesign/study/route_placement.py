"""Tags placed along a study's routes, for every layout, antenna and distance of its space."""

import math
from dataclasses import dataclass, replace

from rfiddesign.design import Design, span_mm
from rfiddesign.floor import Floor
from rfiddesign.geometry import PlacedPattern, PlannedPattern, RouteStrip
from rfiddesign.optimize import Unbuildable
from rfiddesign.optimize.tag_placement import PlacementRules, choose_tags
from rfiddesign.simulation.monte_carlo import Simulator
from rfiddesign.study.config import StudyFile
from rfiddesign.study.load import Study
from rfiddesign.study.routes import strip_of
from rfiddesign.study.stages import OnStage, Stage


@dataclass(frozen=True)
class Placed:
    """Designs whose tags have been placed, by number, and those for which that cannot be done."""

    designs: dict[int, Design]
    unbuildable: tuple[Unbuildable, ...]


def place_planned(
    study: Study, floor: Floor, designs: dict[int, Design], simulator: Simulator, on_stage: OnStage
) -> Placed:
    """Place the tags of every design that leaves them to be placed along routes; the others stay as they are."""
    numbers: dict[Design, list[int]] = {}
    for number, design in designs.items():
        if isinstance(design.pattern, PlannedPattern):
            numbers.setdefault(design, []).append(number)
    if not numbers:
        return Placed(designs, ())
    on_stage(Stage(f"placing tags along routes for {len(numbers)} pairs of robot and distance"))
    strip = strip_of(study.file, study.path, floor)
    found = simulator.map(lambda design: _with_tags(study.file, design, strip), numbers)
    placed, faults = dict(designs), []
    for (planned, mine), design in zip(numbers.items(), found, strict=True):
        if isinstance(design, Design):
            placed |= dict.fromkeys(mine, design)
            continue
        placed = {number: kept for number, kept in placed.items() if number not in mine}
        reason = f"pattern {planned.pattern.name}: {design}"
        faults.append(Unbuildable(planned.layout.name, planned.antenna.name, reason, frozenset(mine)))
    return Placed(placed, tuple(faults))


def placement_rules(file: StudyFile, design: Design, distance_mm: float) -> PlacementRules:
    """What the tags of a design are placed to promise, as the study has it."""
    section = file.routes
    return PlacementRules(
        distance_mm=distance_mm,
        delta_mm=section.delta_mm,
        n_spare=section.n_spare,
        lateral_mm=section.lateral_mm,
        n_laterals=section.n_laterals if section.lateral_mm else 1,
        yaw_rad=math.radians(section.yaw_deg),
        n_yaws=3 if section.yaw_deg else 1,
        margin_mm=section.margin_mm,
        along_mm=section.along_mm,
        across_mm=section.across_mm,
        min_tag_distance_mm=span_mm(design.antenna.area) if design.reader.sees_one_tag_only else 0.0,
        is_in_lines=section.is_in_lines,
        n_search_rounds=section.search_rounds,
        # What is proved takes minutes, and there are many to place.
        is_proved=False,
    )


def _with_tags(file: StudyFile, design: Design, strip: RouteStrip) -> Design | ValueError:
    """The design with its tags placed, or why that cannot be done."""
    distance = design.pattern.distance_mm
    try:
        tags = choose_tags(
            strip.routes_mm, design.layout, design.antenna.area, placement_rules(file, design, distance), strip.swath,
            file.seed,
        )  # fmt: skip
        return replace(design, pattern=PlacedPattern(tags, distance, strip))
    except ValueError as error:
        return error
