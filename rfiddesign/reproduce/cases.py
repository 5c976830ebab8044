"""The cases of a reproduction of floor systems, made ready to be simulated."""

import math
from dataclasses import dataclass
from typing import Any

from rfiddesign.catalog import Antenna, antenna
from rfiddesign.design import Design
from rfiddesign.errors import StudyError
from rfiddesign.floor import Floor, rectangle_floor
from rfiddesign.geometry import LAYOUTS, Disc, ReaderLayout, Rectangle, make_layout, make_pattern, single
from rfiddesign.reproduce.config import CaseSection, ReproductionFile, RouteSection, RowSection
from rfiddesign.reproduce.reproduction import Reproduction
from rfiddesign.simulation.fixed_route import FixedRoute, circle
from rfiddesign.simulation.scenario import Routes, Scenario
from rfiddesign.study.estimators import estimators_of, world_of
from rfiddesign.study.toml_file import validate

# The robot's body plays no role on these floors, which have no walls.
_FOOTPRINT_MM = 100.0


@dataclass(frozen=True)
class Case:
    """A case ready to be simulated."""

    section: CaseSection
    design: Design
    scenario: Scenario


def case_of(loaded: Reproduction, row: RowSection) -> Case:
    """The case of a row."""
    key = f"rows ({row.table}, {row.row})"
    data = _copy(loaded.file.base)
    for path, value in row.set.items():
        *tables, last = path.split(".")
        target = data
        for table in tables:
            target = target.setdefault(table, {})
            if not isinstance(target, dict):
                raise StudyError(f"{path} is set below a value that is no table", file=loaded.path, key=key)
        if path in ("tags_per_m2", "pitch_mm"):
            data.pop("pitch_mm", None), data.pop("tags_per_m2", None)
        target[last] = _copy(value)
    try:
        section = validate(CaseSection, data, loaded.path)
    except StudyError as error:
        place = f"{key}: {error.key}" if error.key else key
        raise StudyError(error.problem, file=loaded.path, key=place) from None
    try:
        return build_case(section, loaded.file)
    except ValueError as error:
        raise StudyError(str(error), file=loaded.path, key=key) from None


def build_case(section: CaseSection, file: ReproductionFile) -> Case:
    """Design and scenario of a case; ValueError for what is unknown or out of bounds."""
    pattern = make_pattern(section.pattern, tags_per_m2=section.tags_per_m2, pitch_mm=section.pitch_mm)
    design = Design(_layout(section.layout, file.layouts), _antenna(section.antenna, file), pattern)
    length, width = (1e3 * side for side in section.floor_m)
    floor = rectangle_floor(length, width, _FOOTPRINT_MM)
    route = _route(section.route, floor)
    duration = section.duration_s
    if duration is None:
        if not isinstance(route, FixedRoute):
            raise ValueError("duration_s is missing: random routes have no end")
        # A last step that the route fills in part only would count the robot standing.
        duration = math.floor(route.duration_s / section.dt_s + 1e-6) * section.dt_s
    scenario = Scenario(
        floor=floor,
        routes=route,
        world=world_of(section.world),
        estimator=estimators_of(section, section.world, section.route.speed_mm_per_s)[section.estimator],
        start=section.start,
        duration_s=duration,
        dt_s=section.dt_s,
        settle_s=section.settle_s,
        start_offset=(*section.start_offset_mm, section.start_offset_rad),
        is_delay_known=section.world.is_delay_known,
    )
    return Case(section, design, scenario)


def _route(section: RouteSection, floor: Floor) -> FixedRoute | Routes:
    turn_rate = math.radians(section.turn_rate_deg_per_s)
    if section.kind == "random":
        headings = ("along",) if section.heading_deg is None else ("constant",)
        return Routes((section.speed_mm_per_s,), section.aligned_share, headings, turn_rate)
    if section.kind == "circle":
        low_x, low_y, high_x, high_y = floor.navigable_bounds
        centre = section.centre_mm or ((low_x + high_x) / 2, (low_y + high_y) / 2)
        waypoints = circle(tuple(centre), section.radius_mm, section.laps, math.radians(section.start_deg))
    else:
        waypoints = tuple(map(tuple, section.waypoints_mm))
    return FixedRoute(
        waypoints,
        section.speed_mm_per_s,
        None if section.heading_deg is None else math.radians(section.heading_deg),
        turn_rate,
        section.stay_s,
        section.shift_mm,
        section.is_turned,
    )


def _antenna(name: str, file: ReproductionFile) -> Antenna:
    own = file.antennas.get(name)
    if own is None:
        return antenna(name)
    if own.disc_radius_mm is not None:
        return Antenna(name, (2 * own.disc_radius_mm,) * 2, Disc(own.disc_radius_mm), own.source)
    return Antenna(name, tuple(own.rectangle_mm), Rectangle(*own.rectangle_mm), own.source)


def _layout(name: str, own: dict[str, dict[str, Any]]) -> ReaderLayout:
    if name in own:
        return make_layout({**own[name], "name": name})
    if name == "single":
        return single()
    if name not in LAYOUTS:
        raise ValueError(f"layout is {name!r}, must be one of {', '.join([*own, 'single', *LAYOUTS])}")
    return make_layout(name)


def _copy(data: Any) -> Any:
    return {key: _copy(value) for key, value in data.items()} if isinstance(data, dict) else data
