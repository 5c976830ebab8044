"""Does an as-built survey of the chosen design's floor pay?  Floors as laid, their surveys, and drives with each map.

For each declared installation error a floor is laid once and surveyed.  Then the robots drive over this one floor with
four maps, run i on the same route with the same noise each time:

- *nominal*: the plan;
- *checked*: the plan with the dead tags that the survey found struck off, the swapped ones put right and the misplaced
  ones at the planned place nearest to where they were found;
- *surveyed*: the places that the survey found;
- *true*: where the tags lie, the best that any survey could do.

A filter that can be told is told of each map how far off its tags are believed to be: as declared, or as the survey
says.  Mistakes
are to be put right on any floor, so that the advice is about places: a survey pays if the surveyed map saves a share
of the checked one's error that is worth anything and certain, and if no denser floor reaches its mean error for less
money.  Dead and swapped tags of a denser floor are known from the simulation, which is not charged.  What putting
mistakes right saves is told apart.  Of a recorded log nobody knows the truth: a floor is drawn from what the survey
says of each tag.
"""

from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property
from typing import get_args

import numpy as np

from rfiddesign.cost import Cost, CostLine, Price, Site, line_of
from rfiddesign.design import Design
from rfiddesign.estimators.registry import Settings
from rfiddesign.estimators.tag_mapping.soft_grid import ReferenceDrift
from rfiddesign.estimators.tag_mapping.survey import DEAD, MISPLACED, SurveyedTags, survey_tags
from rfiddesign.evaluate import MOST_CERTAIN_READ
from rfiddesign.floor import Floor
from rfiddesign.geometry import make_pattern
from rfiddesign.metrics import RunMetrics
from rfiddesign.models.robot import Robot
from rfiddesign.models.survey_log import SurveyLog
from rfiddesign.simulation.as_built import LaidFloor, LayingFaults, lay_floor, map_in_use, runs_on_floor
from rfiddesign.simulation.monte_carlo import Simulator
from rfiddesign.simulation.survey_drive import SurveyDrive, SurveyPlan, SurveyRobot, drive_survey
from rfiddesign.study.candidates import Candidate, Candidates
from rfiddesign.study.checked import checked
from rfiddesign.study.estimators import estimators_of
from rfiddesign.study.load import Study, check_tag_count
from rfiddesign.study.pipeline import Answer, price_design
from rfiddesign.study.sections import PatternKind
from rfiddesign.study.stages import OnStage, Stage
from rfiddesign.study.survey_config import SurveySection, recorded_log
from rfiddesign.study.survey_found import Denser, Drives, FloorFound, SurveyFound
from rfiddesign.units import DEG_PER_RAD

# A filter must not take a map for exact [mm].
_LEAST_SIGMA_MM = 0.1
# After so many passes mistakes are counted once more.
EARLY_PASSES = 2
_STREAM_POSTERIOR = 73


@dataclass(frozen=True, eq=False)
class _Survey:
    """Everything that the floors of a study have in common."""

    study: Study
    section: SurveySection
    floor: Floor
    answer: Answer
    candidate: Candidate
    simulator: Simulator
    on_stage: OnStage

    @property
    def robot(self) -> Robot:
        """The survey's robot; one lost read proves nothing to it."""
        reads = self.candidate.scenarios[0].world.reads
        certain = min(max(reads.read_probability, 0.01), MOST_CERTAIN_READ)
        return Robot.of(self.candidate.design, replace(reads, read_probability=certain))

    @property
    def reference(self) -> ReferenceDrift:
        """Error of the reference localizer."""
        section = self.section
        return ReferenceDrift(section.pose_error_mm, section.heading_error_deg / DEG_PER_RAD, section.correlation_s)

    def told(self, sigma_mm: float) -> Settings:
        """The filter as it is told how far off the tags of its map are."""
        file, sigma = self.study.file, max(sigma_mm, _LEAST_SIGMA_MM)
        world = file.world.model_copy(update={"installation_error_mm": sigma, "dead_share": 0.0})
        return estimators_of(file, world, file.scenario.fastest_mm_per_s)[self.candidate.estimator]

    @cached_property
    def is_told(self) -> bool:
        """Whether that makes a difference: not every filter can be told, and a study may say what it believes."""
        return self.told(1.0) != self.told(100.0)

    @property
    def plan(self) -> SurveyPlan:
        """How the floor is driven over."""
        section = self.section
        return SurveyPlan(
            section.passes, section.lane_pitch_mm, section.speed_mm_per_s, section.turn_rate_deg_per_s / DEG_PER_RAD,
            section.directions, self.candidate.scenarios[0].dt_s,
        )  # fmt: skip


def survey_chosen(
    study: Study, candidates: Candidates, floor: Floor, answers: tuple[Answer, ...], simulator: Simulator,
    on_stage: OnStage,
) -> SurveyFound | None:  # fmt: skip
    """Survey the floor of the first answer's design; None if the study asks for none or nothing was certified.

    Raises
    ------
    StudyError : if the survey cannot be driven, or its log does not fit the design.
    """
    section = study.file.survey
    answer = next((answer for answer in answers if answer.search.winner is not None), None)
    if section is None or answer is None:
        return None
    candidate = candidates.by_number[candidates.numbers[answer.search.winner]]
    survey = _Survey(study, section, floor, answer, candidate, simulator, on_stage)
    return checked(study.path, "survey", lambda: _surveyed(survey))


def _surveyed(survey: _Survey) -> SurveyFound:
    nominal = _nominal(survey.candidate.design, survey.floor)
    log = recorded_log(survey.study.path, survey.study.file)
    floors, cost, hours, log_of = [], None, 0.0, log
    for error in survey.section.installation_errors_mm:
        survey.on_stage(Stage(f"surveying a floor laid to {error:g} mm"))
        if log is None:
            laid = lay_floor(nominal, _faults(survey.section, error), survey.study.file.seed)
            drive = _drive(survey, laid)
            surveyed = _survey(survey, drive.log, nominal, error)
            early = None
            if survey.section.passes > EARLY_PASSES and len((first := drive.first_passes(EARLY_PASSES)).read_tag):
                early = _survey(survey, first, nominal, error)
            log_of, hours = drive.log, drive.duration_s / 3600.0
        else:
            surveyed, early = _survey(survey, log, nominal, error), None
            laid = _drawn(surveyed, survey.study.file.seed)
            hours = log.driven_s / 3600.0
        cost = cost or survey_cost(survey, hours, log_of.driven_mm / 1e3)
        floors.append(_evaluated(survey, error, (laid, surveyed, early)))
    n_lanes = len(np.unique(log_of.stretch))
    return SurveyFound(
        survey.answer, survey.candidate, hours, log_of.driven_mm / 1e3, n_lanes, cost, tuple(floors)
    )  # fmt: skip


def survey_cost(survey: _Survey, hours: float, driven_m: float) -> Cost:
    """What one survey costs."""
    prices = survey.section.prices

    def price(amount: float) -> Price:
        return Price(Decimal(str(amount)), prices.source)

    def quantity(value: float) -> Decimal:
        return Decimal(str(round(value, 2)))

    lines: list[CostLine] = [
        line_of("survey", "driving", quantity(hours), "h", price(prices.per_hour)),
        line_of("survey", "wear and power", quantity(driven_m), "m", price(prices.per_m)),
        line_of("survey", "reference localizer and evaluation", Decimal(1), "piece", price(prices.fixed)),
    ]
    return Cost(survey.study.prices.currency, tuple(lines))


def _nominal(design: Design, floor: Floor) -> np.ndarray:
    return np.asarray(design.pattern.lay(floor.drivable), float)


def _faults(section: SurveySection, error_mm: float, factor: float = 1.0) -> LayingFaults:
    """What goes wrong on a floor with `factor` times as many tags."""
    return LayingFaults(error_mm, section.dead_share, round(factor * section.swapped_pairs))


def _drive(survey: _Survey, laid: LaidFloor) -> SurveyDrive:
    robot = SurveyRobot(survey.candidate.design, survey.candidate.scenarios[0].world, survey.reference)
    return drive_survey(robot, survey.floor, laid, survey.plan, survey.study.file.seed)


def _survey(survey: _Survey, log: SurveyLog, nominal: np.ndarray, error_mm: float) -> SurveyedTags:
    return survey_tags(log, survey.robot, nominal, error_mm, survey.reference, survey.simulator.map)


def _drawn(surveyed: SurveyedTags, seed: int) -> LaidFloor:
    """A floor as likely as any other after a survey."""
    draw = np.random.default_rng([seed, _STREAM_POSTERIOR]).standard_normal(surveyed.mean_mm.shape)
    roots = np.linalg.cholesky(surveyed.covariance_mm2)
    true = surveyed.mean_mm + np.einsum("nij,nj->ni", roots, draw)
    return LaidFloor(surveyed.nominal_mm, true, surveyed.status == DEAD, surveyed.partner)


def put_right_mm(surveyed: SurveyedTags) -> np.ndarray:
    """Planned places (n, 2) of the tags that the survey found there, of swapped and misplaced ones as well.

    A misplaced tag is mostly half of a swap whose other half is dead or was not read; where the plan has it, it is not.
    """
    nominal = surveyed.nominal_mm
    places = np.where((surveyed.partner >= 0)[:, None], nominal[surveyed.partner], nominal)
    for i in np.flatnonzero(surveyed.status == MISPLACED):
        places[i] = nominal[np.argmin(np.sum((nominal - surveyed.mean_mm[i]) ** 2, axis=1))]
    return places


def _evaluated(survey: _Survey, error: float, found: tuple[LaidFloor, SurveyedTags, SurveyedTags | None]) -> FloorFound:
    laid, surveyed, early = found
    everything, kept, put_right = np.arange(len(laid.nominal_mm)), surveyed.map_mm[0], put_right_mm(surveyed)
    maps = (
        ("nominal", error, everything, laid.nominal_mm),
        ("checked", error, kept, put_right[kept]),
        ("surveyed", surveyed.sigma_mm, *surveyed.map_mm),
        ("true", 0.0, laid.alive, laid.true_mm[laid.alive]),
    )
    drives = []
    for name, sigma, ids, places in maps:
        survey.on_stage(Stage(f"driving over a floor laid to {error:g} mm with the {name} map"))
        told = sigma if survey.is_told else None
        drives.append(Drives(name, told, len(ids), _runs(survey, survey.candidate.design, laid, (ids, places), sigma)))
    goal = float(drives[2].errors_mm.mean())
    return FloorFound(error, laid, survey.section.log is not None, surveyed, early, tuple(drives),
                      tuple(_denser(survey, error, goal)))  # fmt: skip


def _runs(
    survey: _Survey, design: Design, laid: LaidFloor, in_map: tuple[np.ndarray, np.ndarray], sigma_mm: float
) -> list[RunMetrics]:
    """Drives over a laid floor with the map of these tags, of which the filter is told how far off they are."""
    scenario = replace(survey.candidate.scenarios[0], estimator=survey.told(sigma_mm))
    return runs_on_floor(survey.simulator, design, scenario, map_in_use(laid, *in_map), range(survey.section.runs))


def _denser(survey: _Survey, error: float, goal_mm: float) -> list[Denser]:
    """Denser floors of the chosen pattern in rising price, up to the first that reaches an error."""
    chosen, found = survey.candidate.design, []
    space = survey.study.file.space
    listed = survey.section.denser_tags_per_m2 or ([] if space is None else space.tags_per_m2)
    if chosen.pattern.name not in get_args(PatternKind):
        return []
    n_chosen = survey.candidate.n_tags
    for density in sorted(density for density in listed if density > chosen.pattern.tags_per_m2):
        pattern = make_pattern(chosen.pattern.name, seed=survey.study.file.seed, tags_per_m2=density)
        check_tag_count(survey.study, pattern, survey.floor, "survey.denser_tags_per_m2")
        design = replace(chosen, pattern=pattern)
        survey.on_stage(Stage(f"driving over {density:g} tags/m2 laid to {error:g} mm"))
        nominal = _nominal(design, survey.floor)
        laid = lay_floor(nominal, _faults(survey.section, error, len(nominal) / n_chosen), survey.study.file.seed)
        place = np.where((laid.partner >= 0)[:, None], nominal[laid.partner], nominal)
        runs = _runs(survey, design, laid, (laid.alive, place[laid.alive]), error)
        drives = Drives("checked", error if survey.is_told else None, len(laid.alive), runs)
        reaches = float(drives.errors_mm.mean()) <= goal_mm
        found.append(Denser(design, len(nominal), _extra_cents(survey, design, len(nominal)), drives, reaches))
        if reaches:
            break
    return found


def _extra_cents(survey: _Survey, design: Design, n_tags: int) -> int:
    """What a design costs more than the chosen one."""

    def cents(design: Design, n_tags: int) -> int:
        site = Site(survey.answer.n_robots, survey.candidate.tagged_m2)
        return price_design(survey.study, design, n_tags, site).total_cents

    return cents(design, n_tags) - cents(survey.candidate.design, survey.candidate.n_tags)
