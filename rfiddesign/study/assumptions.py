"""What an answer rests on, in rows that a report can print."""

from rfiddesign.catalog import antennas
from rfiddesign.results.study_result import Assumption
from rfiddesign.study.config import MclSection, NoiseSection
from rfiddesign.study.load import Study

STUDY_FILE = "study file"
PAPER = "hf_multireader_mcl"
DEFAULT_SHAPE = (MclSection().sigma_per_radius, MclSection().beta)


def assumptions(study: Study) -> list[Assumption]:
    """Everything that was assumed of world, estimator and hardware, with its source."""
    file = study.file
    scenario, world, filter_ = file.scenario, file.world, file.mcl
    believed = filter_.odometry or world.odometry
    rows = [
        ("fleet sizes", ", ".join(str(n) for n in file.fleet.robots), STUDY_FILE),
        ("length of a run, filter step", f"{scenario.duration_s:g} s, {scenario.dt_s:g} s", STUDY_FILE),
        ("speeds, drawn per run", f"{_listed(scenario.speeds_mm_per_s)} mm/s", STUDY_FILE),
        ("share of runs along the tag lattice's axes", f"{scenario.aligned_share:.0%}", STUDY_FILE),
        ("manner of heading, drawn per run", ", ".join(scenario.headings), STUDY_FILE),
        ("speed of turns in place", f"{scenario.turn_rate_deg_per_s:g} deg/s", STUDY_FILE),
        ("start", scenario.start, STUDY_FILE),
        ("age of reads", "compensated" if filter_.is_age_compensated else "ignored", STUDY_FILE),
        (
            "odometry noise (true)",
            f"{world.odometry.noise_mm_per_s:g} mm/s and {world.odometry.noise_rad_per_s:g} rad/s per step",
            f"{PAPER}, eq. 1; size: {_source(world.odometry, NoiseSection())}",
        ),
        (
            "odometry noise (believed)",
            f"{believed.noise_mm_per_s:g} mm/s and {believed.noise_rad_per_s:g} rad/s per step",
            STUDY_FILE,
        ),
        ("chance that a poll with a tag in view reads", f"{world.read_probability:g}", STUDY_FILE),
        ("polling", world.polling, STUDY_FILE),
        (
            "installation error of a tag, per axis",
            f"{world.installation_error_mm:g} mm, drawn anew in every drive: the promise is over all such floors",
            STUDY_FILE,
        ),
        (
            "estimator",
            f"Monte-Carlo localization, {filter_.n_particles} particles, reinitialization "
            f"{'on' if filter_.reinitialize else 'off'} (alpha {filter_.alpha:g})",
            f"{PAPER}, Algorithm 1",
        ),
        (
            "likelihood",
            f"{filter_.likelihood}, sigma {filter_.sigma_per_radius:g} x radius, beta {filter_.beta:g}",
            f"{PAPER}, eq. 6; sigma and beta: {_source((filter_.sigma_per_radius, filter_.beta), DEFAULT_SHAPE)}",
        ),
        ("footprint of a robot", f"disc of {file.robot.footprint_radius_mm:g} mm radius", STUDY_FILE),
    ]
    known = antennas()
    for name in file.space.antenna:
        rows.append((f"antenna {name}", f"sees {known[name].area.area_mm2:,.0f} mm2 of floor", known[name].source))
    return [Assumption(what=what, value=value, source=source) for what, value, source in rows]


def _source(value: object, calibrated: object) -> str:
    """Where a number comes from: prototypes calibrated the defaults, whatever else is there was typed."""
    return f"calibrated on tables of {PAPER} by prototypes" if value == calibrated else STUDY_FILE


def _listed(values: list[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)
