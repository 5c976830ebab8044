"""Routes of a study: the network that robots drive, and patterns of tags along it."""

import math
from functools import lru_cache
from pathlib import Path

from rfiddesign.floor import BundleRules, Floor, NetworkRules, RouteNetwork, bundled_routes
from rfiddesign.geometry import ON_ROUTES, PLACED, PlannedPattern, RouteStrip, TagPattern, on_routes
from rfiddesign.simulation.network_drive import NetworkDrive
from rfiddesign.simulation.scenario import Routes
from rfiddesign.study.checked import checked
from rfiddesign.study.config import StudyFile

# A network of a large map takes seconds, and is asked for several times in a study.
_network = lru_cache(maxsize=8)(bundled_routes)


def network_of(file: StudyFile, path: Path, floor: Floor) -> RouteNetwork:
    """The routes between the study's stations.

    Raises
    ------
    StudyError : if the floor has no room for stations or routes.
    """
    section = file.routes
    if section.stations is not None:
        key, stations = "routes.stations", section.stations
    else:
        key, stations = "routes.stations_m", tuple((1e3 * x, 1e3 * y) for x, y in section.stations_m)
    rules = NetworkRules(
        section.cell_mm, section.lateral_mm, BundleRules(clearance_mm=section.clearance_mm, joins=section.joins)
    )
    return checked(path, key, lambda: _network(floor, stations, file.robot.footprint_radius_mm, rules, seed=file.seed))


def strip_of(file: StudyFile, path: Path, floor: Floor) -> RouteStrip:
    """The floor that robots sweep along the routes, and how they drive there."""
    network = network_of(file, path, floor)
    section = file.routes
    return RouteStrip(network.swath, network.edges_mm, section.lateral_mm, math.radians(section.yaw_deg))


def drive_of(file: StudyFile, path: Path, floor: Floor) -> Routes | NetworkDrive:
    """How robots drive: along the study's routes, or anywhere on the floor."""
    scenario, turn_rate = file.scenario, math.radians(file.scenario.turn_rate_deg_per_s)
    speeds, headings = tuple(scenario.speeds_mm_per_s), tuple(scenario.headings)
    if not file.drives_on_routes:
        return Routes(speeds, scenario.aligned_share, headings, turn_rate)
    section = file.routes
    return NetworkDrive(
        network_of(file, path, floor), speeds, headings, turn_rate, section.lateral_mm, math.radians(section.yaw_deg)
    )


def route_patterns(file: StudyFile, path: Path, floor: Floor, kind: str) -> tuple[TagPattern, ...]:
    """The patterns on routes of one kind: for each density, or those to be placed, for each distance."""
    if kind == PLACED:
        return tuple(PlannedPattern(distance) for distance in file.routes.distances_mm)
    strip = strip_of(file, path, floor)
    return tuple(
        checked(path, "space.pattern", lambda density=density: on_routes(kind, density, file.seed, strip))
        for density in file.space.tags_per_m2
    )


def is_on_routes(kind: str) -> bool:
    """Whether a kind of pattern lies on routes alone."""
    return kind == PLACED or kind in ON_ROUTES


def route_assumptions(file: StudyFile) -> list[tuple[str, str]]:
    """What is assumed of routes and of tags along them: what, and its value."""
    section = file.routes
    if not file.drives_on_routes:
        return []
    n = section.stations or len(section.stations_m)
    joins = "between all pairs" if section.joins == "all" else "along a spanning tree"
    where = "spread over the floor by the program" if section.stations is not None else "as given"
    rows = [
        ("where robots drive", "along routes between stations, every design and every drive"),
        ("stations", f"{n}, {where}; the next one is drawn with equal chance"),
        (
            "routes",
            f"{joins} of stations, {section.clearance_mm:g} mm of clearance preferred",
        ),
        ("off the route, drawn for every way", f"up to {section.lateral_mm:g} mm and {section.yaw_deg:g} deg"),
    ]
    if file.space is not None and PLACED in file.space.pattern:
        dead = "any one tag" if section.n_spare == 1 else f"any {section.n_spare} tags"
        spare = f"with {dead} of a window dead" if section.n_spare else "with all tags alive"
        rows.append(
            (
                "tags placed along routes",
                f"a read within {_listed(section.distances_mm)} mm of way, {spare}, by {section.search_rounds:,} rounds"
                f" of search; a tag counts {section.margin_mm:g} mm inside an antenna's area",
            )
        )
    return rows


def _listed(values: list[float]) -> str:
    return " or ".join(f"{value:g}" for value in values)
