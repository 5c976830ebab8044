"""What an answer rests on, in rows that a report can print."""

from collections.abc import Callable
from typing import Any

from rfiddesign.catalog import antennas, readers
from rfiddesign.estimators.registry import Settings
from rfiddesign.models.motion import DifferentialMotion, OmnidirectionalMotion
from rfiddesign.results.study_result import Assumption
from rfiddesign.study.config import StudyFile
from rfiddesign.study.estimator_config import MclSection
from rfiddesign.study.estimators import motion_of
from rfiddesign.study.load import Study
from rfiddesign.study.routes import route_assumptions
from rfiddesign.study.sections import Section
from rfiddesign.study.world_config import FaultsSection, OdometrySection, WorldSection

STUDY_FILE = "study file"
# The key of what a filter with particles has.
PARTICLES = "n_particles"
PAPER = "hf_multireader_mcl"
NAVIFLOOR = "rssi_kalman_navifloor"
DEFAULT_SHAPE = (MclSection().sigma_per_radius, MclSection().beta)
ODOMETRY_SOURCES = {
    "omnidirectional": f"{PAPER}, eq. 1",
    "mecanum": f"{NAVIFLOOR}, section V-C",
    "differential": "R. Siegwart, I. Nourbakhsh: Introduction to Autonomous Mobile Robots, eq. 5.13",
}
# What each estimator is, and where it comes from.
ESTIMATOR_WORDS = {
    "mcl": ("Monte-Carlo localization", f"{PAPER}, Algorithm 1"),
    "pmg": ("projected-moment Gaussian filter", "rfiddesign.estimators.pmg"),
    "particle_filter": ("particle filter with the detection field as likelihood", f"{NAVIFLOOR}, section IV-C"),
    "quantized_ekf": ("quantized extended Kalman filter", f"{NAVIFLOOR}, eqs. 5-7"),
    "constrained_ekf": ("constrained extended Kalman filter", f"{NAVIFLOOR}, eq. 12"),
    "markov": ("Markov localization on a grid with Kalman heading", "markov_kalman_smart_floor, eqs. 5-11"),
    "rigid_fit": ("rigid fit of antennas to the tags read", f"{PAPER}, table 1 (kinematics)"),
    "trigonometric": ("place of the tag read, heading between tags", f"{PAPER}, table 1 (trigonometric functions)"),
    "motion_continuity": ("line through successive centres of tags", f"{PAPER}, table 1 (motion continuity)"),
    "weighted_centre": ("weighted centre of tags in view", f"{PAPER}, table 1 (sparse patterns)"),
    "odometry": ("odometry alone", "dead reckoning"),
    "histogram": ("histogram filter, the exact reference", "exact Bayes filter on a grid"),
}


def assumptions(study: Study) -> list[Assumption]:
    """Everything that was assumed of world, estimator and hardware, with its source."""
    file = study.file
    scenario, world = file.scenario, file.world
    rows = [
        ("fleet sizes", ", ".join(str(n) for n in file.fleet.robots), STUDY_FILE),
        ("length of a run, filter step", f"{scenario.duration_s:g} s, {scenario.dt_s:g} s", STUDY_FILE),
        _speeds(file),
        *_where(file),
        ("manner of heading, drawn per run", ", ".join(scenario.headings), STUDY_FILE),
        ("speed of turns in place", f"{scenario.turn_rate_deg_per_s:g} deg/s", STUDY_FILE),
        ("start", scenario.start, STUDY_FILE),
        ("age of reads", _of_each(file, _age), STUDY_FILE),
        ("odometry noise (true)", _odometry(world.odometry), _odometry_source(world.odometry)),
        ("odometry noise (believed)", _of_each(file, lambda s: _odometry(s.odometry or world.odometry)), STUDY_FILE),
        ("systematic faults of the odometry", _faults(world.faults), STUDY_FILE),
        ("reader", file.robot.reader, readers()[file.robot.reader].source),
        ("chance that a poll with a tag in view reads", f"{world.read_probability:g}", STUDY_FILE),
        ("tags in view that answer to a poll", world.answers, STUDY_FILE),
        ("polling", _polling(world), STUDY_FILE),
        ("time a tag must be in the field to answer", f"{world.read_time_s:g} s", STUDY_FILE),
        (
            f"delay of reads, of which the filter is {'told' if world.is_delay_known else 'not told'}",
            f"{world.delay_s:g} s",
            STUDY_FILE,
        ),
        (
            "installation error of a tag, per axis",
            f"{world.installation_error_mm:g} mm, drawn anew in every drive: the promise is over all such floors",
            STUDY_FILE,
        ),
        *_unknown_to_estimator(world),
        *_estimators(file),
        ("footprint of a robot", f"disc of {file.robot.footprint_radius_mm:g} mm radius", STUDY_FILE),
    ]
    known = antennas()
    for name in file.antenna_names:
        rows.append((f"antenna {name}", f"sees {known[name].area.area_mm2:,.0f} mm2 of floor", known[name].source))
    return [Assumption(what=what, value=value, source=source) for what, value, source in rows]


def _where(file: StudyFile) -> list[tuple[str, str, str]]:
    """Rows on where robots drive."""
    if file.drives_on_routes:
        return [(what, value, STUDY_FILE) for what, value in route_assumptions(file)]
    return [("share of runs along the tag lattice's axes", f"{file.scenario.aligned_share:.0%}", STUDY_FILE)]


def _speeds(file: StudyFile) -> tuple[str, str, str]:
    """How fast robots drive."""
    if file.varies("speed_mm_per_s"):
        return ("speed", "each design's own, which its name says", STUDY_FILE)
    return ("speeds, drawn per run", f"{_listed(file.scenario.speeds_mm_per_s)} mm/s", STUDY_FILE)


def _unknown_to_estimator(world: WorldSection) -> list[tuple[str, str, str]]:
    """Rows on what is wrong with floor and antennas and no estimator is told, where there is any."""
    rows = []
    if world.dead_share > 0:
        share = f"{100 * world.dead_share:g} %, drawn anew in every drive: the promise is over all such floors"
        rows.append(("tags that never answer, of which the filter is not told", share, STUDY_FILE))
    if world.field_scale != 1:
        size = f"{world.field_scale:g} times the catalogue's, which the filter and the coverage believe"
        rows.append(("true size of the detection fields", size, STUDY_FILE))
    return rows


def estimator_words(name: str, settings: Settings, *, is_counted: bool = True) -> str:
    """An estimator in a line, as "Monte-Carlo localization, 500 particles"; uncounted where each design has its own."""
    n_particles = getattr(settings, "n_particles", None) if is_counted else None
    return ESTIMATOR_WORDS[name][0] + ("" if n_particles is None else f", {n_particles:,} particles")


def _of_each(file: StudyFile, words: Callable[[Any], str]) -> str:
    """What holds for the estimator; where it is left open and they differ, for each of them."""
    found = {name: words(file.settings_of(name)) for name in file.estimator_names}
    if len(set(found.values())) == 1:
        return found[file.estimator_names[0]]
    return "; ".join(f"{name}: {value}" for name, value in found.items())


def _age(section: Any) -> str:
    return "compensated" if section.is_age_compensated else "ignored"


def _estimators(file: StudyFile) -> list[tuple[str, str, str]]:
    """Rows on the estimator and its settings; where it is left open, on those that the search chose from."""
    names = file.estimator_names
    if len(names) == 1:
        return _estimator(file, names[0])
    rows = [("estimator", f"chosen by the search with each design: {', '.join(names)}", STUDY_FILE)]
    for name in names:
        rows += [(f"{name}: {what}", value, source) for what, value, source in _estimator(file, name)]
    return rows


def _estimator(file: StudyFile, name: str) -> list[tuple[str, str, str]]:
    """Rows on one estimator and its settings."""
    words, source = ESTIMATOR_WORDS[name]
    if name != "mcl":
        given = _settings(file.settings_of(name), PARTICLES if file.varies(PARTICLES) else "")
        return [("estimator", words, source), ("settings of the estimator", given or "defaults", STUDY_FILE)]
    filter_ = file.mcl
    n_particles = "each design's number of" if file.varies(PARTICLES) else f"{filter_.n_particles}"
    return [
        (
            "estimator",
            f"{words}, {n_particles} particles, reinitialization "
            f"{'on' if filter_.reinitialize else 'off'} (alpha {filter_.alpha:g})",
            source,
        ),
        (
            "likelihood",
            f"{filter_.likelihood}, sigma {filter_.sigma_per_radius:g} x radius, beta {filter_.beta:g}",
            f"{PAPER}, eq. 6; sigma and beta: {_source((filter_.sigma_per_radius, filter_.beta), DEFAULT_SHAPE)}",
        ),
    ]


def _settings(section: Section, varied: str) -> str:
    """Settings of an estimator in a line, without the varied one, and what the rest of the study works out."""
    values = section.model_dump(exclude={"odometry", "is_age_compensated", varied})
    return ", ".join(f"{key} {_word(value)}" for key, value in values.items() if value is not None)


def _word(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _odometry(section: OdometrySection) -> str:
    """The noise of an odometry in words, defaults included."""
    motion = motion_of(section)
    if isinstance(motion, OmnidirectionalMotion):
        return f"{motion.noise_x_mm_per_s:g} mm/s and {motion.noise_heading_rad_per_s:g} rad/s per step"
    if isinstance(motion, DifferentialMotion):
        return f"{motion.wheel_noise_mm_per_sqrt_m:g} mm per sqrt(m) of each wheel, track {motion.track_mm:g} mm"
    return (
        f"{motion.noise_x_mm_per_sqrt_m:g} mm ahead, {motion.noise_y_mm_per_sqrt_m:g} mm sideways and"
        f" {motion.noise_heading_rad_per_sqrt_m:g} rad per sqrt(m), {motion.noise_heading_rad_per_sqrt_rad:g} rad per"
        " sqrt(rad)"
    )


def _odometry_source(section: OdometrySection) -> str:
    size = _source(_odometry(section), _odometry(OdometrySection()))
    return f"{ODOMETRY_SOURCES[section.model]}; size: {size}"


def _faults(section: FaultsSection) -> str:
    """The faults that there are."""
    there = {key: value for key, value in section.model_dump().items() if value}
    return ", ".join(f"{key} {value:g}" for key, value in there.items()) or "none"


def _polling(section: WorldSection) -> str:
    return section.polling + (f", {section.poll_s:g} s per poll" if section.polling == "multiplexed" else "")


def _source(value: object, calibrated: object) -> str:
    """Where a number comes from: prototypes calibrated the defaults, whatever else is there was typed."""
    return f"calibrated on tables of {PAPER} by prototypes" if value == calibrated else STUDY_FILE


def _listed(values: list[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)
