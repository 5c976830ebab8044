"""Load a study once: from its files to frozen records; nothing below this module sees a dict."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import shapely
from shapely.geometry import Polygon

from rfiddesign.catalog import Reader, antenna, antennas, reader
from rfiddesign.cost import PriceList, ShelfPrices
from rfiddesign.design import Design
from rfiddesign.errors import StudyError
from rfiddesign.floor import Floor, MapThresholds, floor_from_map, read_ros_map, rectangle_floor
from rfiddesign.geometry import LAYOUTS, ReaderLayout, TagPattern, make_layout, make_pattern, tagged_mm2
from rfiddesign.metrics import Requirement
from rfiddesign.optimize import Space
from rfiddesign.simulation.run import true_poses
from rfiddesign.simulation.scenario import Scenario
from rfiddesign.study.checked import checked as _checked
from rfiddesign.study.config import FloorSection, RequirementSection, StudyFile
from rfiddesign.study.criteria import BASE, Criteria, further_limit
from rfiddesign.study.estimators import estimators_of, world_of
from rfiddesign.study.hall import hall_of
from rfiddesign.study.overrides import apply_overrides, resolved, with_values
from rfiddesign.study.placements import placed_layout, placement_problem
from rfiddesign.study.price_lists import price_list, shelf_price_list
from rfiddesign.study.routes import drive_of, is_on_routes, route_patterns
from rfiddesign.study.scenarios_config import CHANGEABLE, FurtherScenario
from rfiddesign.study.toml_file import read_toml, validate
from rfiddesign.study.variants import Variant, read_variants
from rfiddesign.units import MM2_PER_M2

FILE_NAME = "study.toml"
# 2.25 mm from the true disc at a radius of 300 mm would reject antennas that fit: many segments.
_DISC_SEGMENTS = 256
# A tag each 10 mm over the largest floor that fits memory.
MAX_TAGS = 20_000_000


@dataclass(frozen=True)
class Study:
    """A study as read.

    Parameters
    ----------
    path : the study file.
    file : its contents, checked, with all defaults.
    prices : the price list.
    requirement : limits that a run must keep.
    variants : the variants that the file names, each a complete study.
    further : the further scenarios that the file names: the file as each of them sets it, by name.
    shelf_prices : the price list of the designs on its shelves, if it has any.
    """

    path: Path
    file: StudyFile
    prices: PriceList
    requirement: Requirement
    variants: tuple[Variant, ...] = ()
    further: tuple[tuple[str, StudyFile], ...] = ()
    shelf_prices: ShelfPrices | None = None

    @property
    def criteria(self) -> Criteria:
        """All that the study asks of a design."""
        return criteria_of(self.file)

    @property
    def name(self) -> str:
        """Name of the study's folder."""
        return self.path.resolve().parent.name

    @property
    def footprint(self) -> Polygon:
        """The robot's footprint, centred [mm]."""
        return shapely.Point(0, 0).buffer(self.file.robot.footprint_radius_mm, quad_segs=_DISC_SEGMENTS)


def criteria_of(file: StudyFile) -> Criteria:
    """All that a study file asks of a design."""
    search = file.search
    return Criteria(
        _requirement(file.requirement), search.hold_probability, search.fail_probability,
        tuple(further_limit(section) for section in file.requirements),
        (BASE, *(scenario.name for scenario in file.scenarios)),
    )  # fmt: skip


def load_study(path: str | Path, settings: tuple[str, ...] = ()) -> Study:
    """Read a study file, or the one in a folder, with KEY=VALUE settings on top, and below those of its variants.

    Raises
    ------
    StudyError : for anything in the study file or its price list that is missing, unknown or out of bounds.
    """
    path = Path(path)
    try:
        path = path / FILE_NAME if path.is_dir() else path
    except OSError as error:
        raise StudyError(f"cannot be read: {error.strerror}", file=path) from None
    data = apply_overrides(read_toml(path), settings)
    study = study_of(path, data)
    return replace(study, variants=read_variants(study, data, lambda changed: study_of(path, changed)))


def study_of(path: Path, data: dict[str, Any]) -> Study:
    """The study that a file's data are, without its variants."""
    file = validate(StudyFile, data, path)
    requirement = _checked(path, "requirement", lambda: _requirement(file.requirement))
    for factor in file.search.limit_factors:
        _checked(path, "search.limit_factors", lambda factor=factor: requirement.scaled(factor))
    further = tuple((scenario.name, _in_scenario(path, data, scenario)) for scenario in file.scenarios)
    shelf_prices = None if file.shelves is None else shelf_price_list(path.parent / file.shelves.prices)
    study = Study(path, file, price_list(path.parent / file.prices), requirement, (), further, shelf_prices)
    _check_names(study)
    return study


def _in_scenario(path: Path, data: dict[str, Any], scenario: FurtherScenario) -> StudyFile:
    """The file as a further scenario sets it."""
    where = f"scenario {scenario.name!r}"
    pairs = resolved(data, scenario.set.items(), path)
    for key, _ in pairs:
        if key.partition(".")[0] not in CHANGEABLE:
            raise StudyError(f"must be a key of {' or '.join(CHANGEABLE)}", file=path, key=f"{where}: {key}")
    own = {key: value for key, value in data.items() if key != "scenarios"}
    try:
        return validate(StudyFile, with_values(own, pairs, path), path)
    except StudyError as error:
        raise StudyError(error.problem, file=path, key=f"{where}: {error.key}") from None


def layout_of(study: Study, name: str, key: str) -> ReaderLayout:
    """The layout of that name, which stands at `key`: the study's own, or one of the paper's."""
    own = study.file.layouts
    if name in own:
        return _own_layout(study, name)
    if name in study.file.placements:
        return placed_layout(study.path, study.file, name)
    if name not in LAYOUTS:
        allowed = ", ".join([*own, *study.file.placements, *LAYOUTS])
        raise StudyError(f"found {name!r}, must be one of {allowed}", file=study.path, key=key)
    return make_layout(name)


def design_of(study: Study) -> Design:
    """The design at hand: the study's [design], as changed by settings."""
    section = study.file.design
    density = section.tags_per_m2 if section.tags_per_m2 or section.pitch_mm else 100.0
    return Design(
        layout_of(study, section.layout, "design.layout"),
        _checked(study.path, "design.antenna", lambda: antenna(section.antenna)),
        _pattern(study, "design.pattern", section.pattern, tags_per_m2=density, pitch_mm=section.pitch_mm),
        reader_of(study),
    )


def reader_of(study: Study) -> Reader:
    """The readers on the robots."""
    return _checked(study.path, "robot.reader", lambda: reader(study.file.robot.reader))


def space_of(study: Study, floor: Floor | None = None) -> Space:
    """The space of designs to search; patterns on routes are those of the study's floor."""
    section = study.file.space
    for name in ("layout", "antenna", "pattern", "tags_per_m2", "estimator"):
        values = getattr(section, name) or []
        if len(set(values)) < len(values):
            raise StudyError(f"found {values}, must not name a value twice", file=study.path, key=f"space.{name}")
    layouts = tuple(layout_of(study, name, "space.layout") for name in section.layout)
    known = antennas()
    patterns: list[TagPattern] = []
    for kind in section.pattern:
        if is_on_routes(kind):
            patterns += route_patterns(study.file, study.path, floor or floor_of(study), kind)
        else:
            patterns += [_pattern(study, "space.pattern", kind, tags_per_m2=each) for each in section.tags_per_m2]
    return _checked(
        study.path,
        "space",
        lambda: Space(
            layouts,
            tuple(known[name] for name in section.antenna),
            tuple(patterns),
            reader_of(study),
            study.file.estimator_names,
        ),
    )


def floor_of(study: Study) -> Floor:
    """The floor, from its map or as a rectangle."""
    section, radius = study.file.floor, study.file.robot.footprint_radius_mm
    if study.file.shelves is not None:
        return hall_of(study.path, study.file).floor
    if section.map is None:
        length_m, width_m = section.rectangle_m
        return _checked(study.path, "floor.rectangle_m", lambda: rectangle_floor(1e3 * length_m, 1e3 * width_m, radius))
    occupancy_map = read_ros_map(study.path.parent / section.map)
    return floor_from_map(occupancy_map, radius, map_thresholds(section), name=study.name)


def map_thresholds(section: FloorSection) -> MapThresholds:
    """How the study reads its map."""
    given = {"occupied": section.occupied_threshold, "speck_pixels": section.speck_pixels}
    return MapThresholds(**{name: value for name, value in given.items() if value is not None})


def scenario_of(study: Study, floor: Floor) -> Scenario:
    """How the study exercises its designs on a floor; where it leaves the estimator open, with the preferred one."""
    file = study.file
    section = file.scenario
    filters = _checked(
        study.path, "scenario", lambda: list(estimators_of(file, file.world, section.fastest_mm_per_s).values())
    )
    settle_s = section.settle_s
    if settle_s is None:
        is_unknown = section.start == "unknown"
        settle_s = min(file.requirement.converged_within_s or 0.0, section.duration_s / 2) if is_unknown else 0.0
    build = lambda: Scenario(  # noqa: E731 - evaluated where its errors are worded
        floor=floor,
        routes=drive_of(file, study.path, floor),
        world=world_of(file.world),
        estimator=filters[0],
        start=section.start,
        duration_s=section.duration_s,
        dt_s=section.dt_s,
        settle_s=settle_s,
        is_delay_known=file.world.is_delay_known,
    )
    scenario = _checked(study.path, "scenario", build)
    for other in filters[1:]:
        _checked(study.path, "scenario", lambda other=other: replace(scenario, estimator=other))
    # A floor too small for a route of that length is found here, before anything is written.
    _checked(study.path, "floor", lambda: true_poses(scenario, file.seed, 0))
    return scenario


def scenarios_of(study: Study, floor: Floor) -> tuple[Scenario, ...]:
    """All scenarios that a design must hold in, that of the study first.

    The robots run the same filter in each: what it believes is what it believes in the first.
    """
    base = scenario_of(study, floor)
    others = (scenario_of(replace(study, file=file), floor) for _, file in study.further)
    return (base, *(replace(other, estimator=base.estimator) for other in others))


def check_tag_count(study: Study, pattern: TagPattern, floor: Floor, key: str) -> None:
    """Raise StudyError if a floor would take more tags, of a density that stands at `key`, than memory should hold."""
    area_m2 = tagged_mm2(pattern, floor.drivable.area) / MM2_PER_M2
    n_tags = pattern.tags_per_m2 * area_m2
    if n_tags > MAX_TAGS:
        raise StudyError(
            f"{pattern.tags_per_m2:g} tags/m2 on {area_m2:,.0f} m2 are {n_tags:,.0f} tags, at most {MAX_TAGS:,}"
            " are allowed",
            file=study.path,
            key=key,
        )


def _check_names(study: Study) -> None:
    """Raise StudyError for layouts and antennas that are nowhere to be found, and for antennas without a price."""
    file = study.file
    reader_of(study)
    for name in file.layouts:
        _own_layout(study, name)
    for name in file.placements:
        if name in file.layouts or name in LAYOUTS:
            raise StudyError("is a layout already; choose another name", file=study.path, key=f"placements.{name}")
        placement_problem(study.path, file, name)
    listed = [] if file.space is None else [("space", file.space.layout, file.space.antenna)]
    explored = [] if file.explore is None else [("explore.ranges", [], file.explore.ranges.antenna)]
    for section, layouts, names in (
        *listed,
        *explored,
        ("design", [file.design.layout], [file.design.antenna]),
    ):
        for name in layouts:
            # Readers are placed when they are asked for, which takes longer than reading a file may.
            if name not in file.placements:
                layout_of(study, name, f"{section}.layout")
        for name in names:
            _checked(study.path, f"{section}.antenna", lambda name=name: antenna(name))
    priced = [name for name, _ in study.prices.antennas]
    for name in file.antenna_names:
        if name not in priced:
            where = "space" if file.space is not None and name in file.space.antenna else "explore.ranges"
            raise StudyError(
                f"has no price for antenna {name!r} of {where}.antenna, only for {', '.join(priced)}",
                file=study.path.parent / file.prices,
                key="per_robot.antenna",
            )


def _own_layout(study: Study, name: str) -> ReaderLayout:
    key, spec = f"layouts.{name}", study.file.layouts[name]
    if name in LAYOUTS:
        raise StudyError("is a layout of hf_multireader_mcl already; choose another name", file=study.path, key=key)
    if "name" in spec:
        raise StudyError(f"unknown key; the layout's name is {name!r} already", file=study.path, key=f"{key}.name")
    return _checked(study.path, key, lambda: make_layout({**spec, "name": name}))


def _requirement(section: RequirementSection) -> Requirement:
    limits = []
    for key in type(section).model_fields:
        value = getattr(section, key)
        if value is None or key == "converged_within_s":
            continue
        limits.append((key.replace("_deg", "_rad"), math.radians(value)) if key.endswith("_deg") else (key, value))
    return Requirement(tuple(limits), section.converged_within_s)


def _pattern(study: Study, key: str, kind: str, **density: float | None) -> TagPattern:
    return _checked(study.path, key, lambda: make_pattern(kind, seed=study.file.seed, **density))
