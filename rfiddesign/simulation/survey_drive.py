"""Drive a survey over a laid floor: lanes along x, then along y, with a reference localizer that is off by a little."""

import math
from dataclasses import dataclass

import numpy as np
import shapely

from rfiddesign import require
from rfiddesign.design import Design
from rfiddesign.estimators.tag_mapping.soft_grid import ReferenceDrift
from rfiddesign.floor import Floor, build_tag_map
from rfiddesign.models.survey_log import MAX_GAP_S, SurveyLog
from rfiddesign.simulation.as_built import LaidFloor, laid_world
from rfiddesign.simulation.record import record_with, rig_of
from rfiddesign.simulation.run import key_of
from rfiddesign.simulation.scenario import World
from rfiddesign.simulation.trajectory import drive

DIRECTIONS = ("crossing", "along x", "along y")
# Lanes, and steps of all lanes together.
MAX_LANES, MAX_STEPS = 100_000, 5_000_000
# Shorter lanes than this are not driven [mm].
_LEAST_LANE_MM = 50.0
_STREAM_REFERENCE = 72
# Lanes draw from streams of their own, beyond those of any run.
_FIRST_LANE = 1 << 40


@dataclass(frozen=True)
class SurveyPlan:
    """How a floor is driven over.

    Parameters
    ----------
    passes : times that lanes are driven over the whole floor.
    lane_pitch_mm : distance of neighbouring lanes [mm]; each pass of a direction shifts its lanes by a part of it.
    speed_mm_per_s : on the lanes and between them [mm/s].
    turn_rate_rad_per_s : speed of turns at the ends of lanes [rad/s].
    directions : "crossing": passes 0, 2, ... along x and 1, 3, ... along y; "along x" or "along y": all alike.
    dt_s : step of the recording [s].
    """

    passes: int = 10
    lane_pitch_mm: float = 100.0
    speed_mm_per_s: float = 300.0
    turn_rate_rad_per_s: float = 1.0
    directions: str = "crossing"
    dt_s: float = 0.05

    def __post_init__(self) -> None:
        require.count("passes", self.passes, at_most=1000)
        require.within("lane_pitch_mm", self.lane_pitch_mm, low=10.0, high=1e5)
        require.within("speed_mm_per_s", self.speed_mm_per_s, low=1.0, high=10_000.0)
        require.within("turn_rate_rad_per_s", self.turn_rate_rad_per_s, low=1e-3, high=100.0)
        require.within("dt_s", self.dt_s, low=1e-3, high=MAX_GAP_S)
        if self.directions not in DIRECTIONS:
            raise ValueError(f"directions is {self.directions!r}, must be one of {', '.join(DIRECTIONS)}")

    def is_along_x(self, number: int) -> bool:
        """Whether a pass drives along x."""
        return self.directions == "along x" or (self.directions == "crossing" and number % 2 == 0)


@dataclass(frozen=True)
class SurveyRobot:
    """A robot of a design in a world, with a reference localizer that is off by a Gauss-Markov process on each axis."""

    design: Design
    world: World
    reference: ReferenceDrift


@dataclass(frozen=True, eq=False)
class SurveyDrive:
    """A survey as driven.

    Parameters
    ----------
    log : what it recorded.
    true_poses : (m, 3) where the robot was in truth at the times of the log's poses.
    duration_s : time from the first lane to the last, ways between lanes included [s].
    lane_pass : (n_lanes,) pass that each lane belongs to.
    """

    log: SurveyLog
    true_poses: np.ndarray
    duration_s: float
    lane_pass: np.ndarray

    def first_passes(self, n: int) -> SurveyLog:
        """The log of the first n passes."""
        return self.log.before(int(np.count_nonzero(self.lane_pass < n)))


def lanes_of(floor: Floor, plan: SurveyPlan) -> tuple[list[np.ndarray], np.ndarray]:
    """Lanes in the order in which they are driven, to and fro: begin and end (2, 2) [mm] and pass (n,) of each."""
    low_x, low_y, high_x, high_y = floor.navigable_bounds
    found: list[np.ndarray] = []
    passes: list[int] = []
    n_driven = {True: 0, False: 0}
    n_of = {way: sum(plan.is_along_x(i) == way for i in range(plan.passes)) for way in (True, False)}
    for number in range(plan.passes):
        way = plan.is_along_x(number)
        low, high, begin, end = (low_y, high_y, low_x, high_x) if way else (low_x, high_x, low_y, high_y)
        # Half a pitch from the border on average, over the passes.
        shift = plan.lane_pitch_mm * (n_driven[way] + 0.5) / n_of[way]
        n_driven[way] += 1
        at = np.arange(low + shift, high, plan.lane_pitch_mm)
        if not len(at):
            at = np.array([(low + high) / 2])
        for k, offset in enumerate(at.tolist()):
            ends = [(begin, offset), (end, offset)] if way else [(offset, begin), (offset, end)]
            pieces = shapely.get_parts(shapely.intersection(floor.navigable, shapely.LineString(ends)))
            rows = [shapely.get_coordinates(piece)[[0, -1]] for piece in pieces if piece.length >= _LEAST_LANE_MM]
            rows.sort(key=lambda piece: float(piece[:, 0 if way else 1].min()))
            rows = [np.sort(piece, axis=0) for piece in rows]
            found += [piece[::-1] for piece in reversed(rows)] if k % 2 else rows
            passes += [number] * len(rows)
    return found, np.array(passes, np.int64)


def drive_survey(robot: SurveyRobot, floor: Floor, laid: LaidFloor, plan: SurveyPlan, seed: int) -> SurveyDrive:
    """Drive `plan` over a laid floor and record what a survey records.

    Odometry plays no part.  The reference's error goes on while the robot turns and drives from lane to lane.

    Raises
    ------
    ValueError : if the floor has no lane, there are over 100,000, or they have over 5 million steps.
    """
    _check_size(floor, plan)
    lanes, lane_pass = lanes_of(floor, plan)
    if not lanes:
        raise ValueError(f"lane_pitch_mm is {plan.lane_pitch_mm:g}: the floor has no lane of {_LEAST_LANE_MM:g} mm")
    return drive_lanes(robot, lanes, lane_pass, laid, plan, seed)


def drive_lanes(
    robot: SurveyRobot, lanes: list[np.ndarray], lane_pass: np.ndarray, laid: LaidFloor, plan: SurveyPlan, seed: int
) -> SurveyDrive:
    """As `drive_survey`, for given lanes: begin and end (2, 2) [mm] and pass (n,) of each."""
    lengths = np.array([float(np.hypot(*(lane[1] - lane[0]))) for lane in lanes])
    steps = np.ceil(lengths / (plan.speed_mm_per_s * plan.dt_s)).astype(np.int64)
    rig = rig_of(robot.design, laid_world(robot.world), plan.dt_s)._replace(lattice=(0.0,) * 6)
    alive = build_tag_map(laid.true_mm[laid.alive])
    begins = _begins(lanes, lengths, steps, plan, rig.robot[3])
    times, poses, reads = [], [], []
    for k, (lane, n_steps) in enumerate(zip(lanes, steps.tolist(), strict=True)):
        true = drive(lane, plan.speed_mm_per_s, None, plan.turn_rate_rad_per_s, plan.dt_s, n_steps)
        recording = record_with(rig, alive, true, plan.dt_s, key_of(seed, _FIRST_LANE + k))
        step = np.repeat(np.arange(n_steps), np.diff(recording.read_start))
        heard = begins[k] + (step + 1) * plan.dt_s - recording.read_age_s
        reads.append((heard, recording.read_antenna, laid.alive[recording.read_tag]))
        times.append(begins[k] + plan.dt_s * np.arange(n_steps + 1))
        poses.append(true)
    time, true = np.concatenate(times), np.concatenate(poses)
    log = SurveyLog(
        time, np.repeat(np.arange(len(lanes)), steps + 1), true + _reference_errors(time, robot.reference, seed),
        *_schedule(rig.robot, plan.dt_s), *(np.concatenate(part) for part in zip(*reads, strict=True)),
    )  # fmt: skip
    return SurveyDrive(log, true, float(time[-1]), lane_pass)


def _check_size(floor: Floor, plan: SurveyPlan) -> None:
    """Raise ValueError for more lanes or steps than a survey may have, before there are any."""
    low_x, low_y, high_x, high_y = floor.navigable_bounds
    n_lanes = plan.passes * max(high_x - low_x, high_y - low_y) / plan.lane_pitch_mm
    if n_lanes > MAX_LANES:
        raise ValueError(f"the survey has about {n_lanes:,.0f} lanes, at most {MAX_LANES:,} are allowed")
    way_mm = plan.passes * floor.navigable.area / plan.lane_pitch_mm
    n_steps = way_mm / (plan.speed_mm_per_s * plan.dt_s)
    if n_steps > MAX_STEPS:
        raise ValueError(f"the survey's lanes have about {n_steps:,.0f} steps, at most {MAX_STEPS:,} are allowed")


def _begins(
    lanes: list[np.ndarray], lengths: np.ndarray, steps: np.ndarray, plan: SurveyPlan, period: int
) -> np.ndarray:
    """When each lane begins (n,) [s]: after turning and driving to it, at a whole number of rounds of polls."""
    found, now, round_s = np.empty(len(lanes)), 0.0, plan.dt_s * period
    for k, lane in enumerate(lanes):
        if k:
            back, ahead = lanes[k - 1][1] - lanes[k - 1][0], lane[1] - lane[0]
            gap = lane[0] - lanes[k - 1][1]
            turned = _angle(back, gap) + _angle(gap, ahead) if np.hypot(*gap) > 1.0 else _angle(back, ahead)
            now += turned / plan.turn_rate_rad_per_s + float(np.hypot(*gap)) / plan.speed_mm_per_s
        found[k] = now = round_s * (math.ceil(now / round_s) + 1)
        now += plan.dt_s * float(steps[k])
    return found


def _angle(one: np.ndarray, other: np.ndarray) -> float:
    """Angle between two ways [rad]."""
    return abs(math.atan2(float(one[0] * other[1] - one[1] * other[0]), float(one @ other)))


def _schedule(robot: tuple, dt_s: float) -> tuple[np.ndarray, np.ndarray]:
    """First poll and period of each antenna [s]; lanes begin at whole periods."""
    _, phases, slots, period = robot
    return (slots + phases) * dt_s, np.full(len(phases), period * dt_s)


def _reference_errors(time: np.ndarray, reference: ReferenceDrift, seed: int) -> np.ndarray:
    """Errors (m, 3) of the reference localizer at rising times (m,)."""
    draws = np.random.default_rng([seed, _STREAM_REFERENCE]).standard_normal((len(time), 3))
    keep = np.exp(-np.diff(time, prepend=-math.inf) / reference.correlation_s)
    fresh = np.sqrt(1.0 - keep**2)[:, None] * draws
    errors, now = np.empty_like(fresh), np.zeros(3)
    for k in range(len(time)):
        now = keep[k] * now + fresh[k]
        errors[k] = now
    return errors * [reference.pose_mm, reference.pose_mm, reference.heading_rad]
