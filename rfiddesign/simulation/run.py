"""One run: a robot of a design drives a route while its filter listens."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rfiddesign.design import Design
from rfiddesign.estimators import mcl, registry
from rfiddesign.estimators.acquisition import start_by_two_tags
from rfiddesign.estimators.start import KnownStart, Start, UnknownStart
from rfiddesign.estimators.verbs import N_ESTIMATE, Filter, known, track, workspace
from rfiddesign.floor import TagMap, random_route
from rfiddesign.metrics import NO_LIMITS, Requirement, RunMetrics, summarize
from rfiddesign.models.robot import Robot
from rfiddesign.numerics._noise_kernels import STREAM_MANNER, STREAM_ROUTE, fill_fine_uniform, run_key, step_key
from rfiddesign.simulation import _run_kernels as kernels
from rfiddesign.simulation._recording_kernels import pose_errors
from rfiddesign.simulation.record import Rig, installed, record_with, rig_of
from rfiddesign.simulation.scenario import Routes, Scenario
from rfiddesign.simulation.trajectory import drive, route_length_mm

# Steps between two looks at whether the run has certainly failed.
STEPS_PER_LOOK = 100


@dataclass(frozen=True)
class Trace:
    """One run step by step: truth and estimate (n_steps + 1, 3), and the errors after each step (n_steps,).

    `n_before` : steps of the run before these, in which the filter waited for its start.
    """

    dt_s: float
    true_poses: np.ndarray
    poses: np.ndarray
    position_error_mm: np.ndarray
    heading_error_rad: np.ndarray
    n_before: int = 0


def true_poses(scenario: Scenario, seed: int, run: int) -> np.ndarray:
    """Poses (n_steps + 1, 3) of run `run`, the same for every design."""
    key, routes = key_of(seed, run), scenario.routes
    if not isinstance(routes, Routes):
        return routes.poses(key, scenario.dt_s, scenario.n_steps)
    draws = np.empty(4)
    fill_fine_uniform(np.uint64(step_key(key, STREAM_MANNER, 0)), draws)
    is_aligned = bool(draws[0] < routes.aligned_share)
    speed = routes.speeds_mm_per_s[int(draws[1] * len(routes.speeds_mm_per_s))]
    manner = routes.headings[int(draws[2] * len(routes.headings))]
    heading = None
    if manner == "constant":
        heading = math.floor(4 * draws[3]) * math.pi / 2 if is_aligned else 2 * math.pi * draws[3]
    waypoints = random_route(
        scenario.floor, step_key(key, STREAM_ROUTE, 0), route_length_mm(speed, scenario.duration_s),
        is_aligned=is_aligned,
    )  # fmt: skip
    return drive(waypoints, speed, heading, routes.turn_rate_rad_per_s, scenario.dt_s, scenario.n_steps)


def start_of(scenario: Scenario, poses: np.ndarray) -> Start:
    """What the filter is told before the first step."""
    if scenario.start == "known":
        return KnownStart(tuple(poses[0] + np.array(scenario.start_offset)))
    return UnknownStart(scenario.floor.navigable_bounds)


@dataclass(frozen=True)
class PreparedDesign:
    """A design made ready for runs in one scenario."""

    rig: Rig
    robot: Robot
    ready: Filter


def prepare(design: Design, scenario: Scenario) -> PreparedDesign:
    """Make a design ready for runs in a scenario."""
    reads = scenario.world.reads
    told = reads if scenario.is_delay_known else replace(reads, delay_s=0.0)
    robot = Robot.of(design, told)
    return PreparedDesign(
        rig_of(design, scenario.world, scenario.dt_s), robot, registry.build(scenario.estimator, robot, scenario.dt_s)
    )


def trace_run(
    prepared: PreparedDesign, scenario: Scenario, tags: TagMap, poses: np.ndarray, key: np.uint64,
    stop_at: Requirement | None = None, known_tags: TagMap | None = None,
) -> Trace:  # fmt: skip
    """Simulate one run and the filter on it; the trace ends early once the run has certainly failed `stop_at`.

    `known_tags` : the map that a filter learns from silent polls by; None: where `tags` has them nominally.
    """
    if scenario.start == "two_tags":
        return _trace_from_two_tags(prepared, scenario, tags, poses, key, known_tags)
    n, ready = scenario.n_steps, prepared.ready
    state = registry.init(ready, start_of(scenario, poses), key)
    estimates, position, heading = np.empty((n + 1, N_ESTIMATE)), np.empty(n + 1), np.empty(n + 1)
    estimates[0] = state.moments
    run = kernels.run_mcl if ready.kernels is mcl.KERNELS else partial(run_in_parts, ready.kernels.track)
    done = run(
        key, poses, prepared.rig, installed(tags), (tags.nominal_x, tags.nominal_y), ready.model,
        known(tags if known_tags is None else known_tags),
        workspace(state), (float(scenario.dt_s), STEPS_PER_LOOK, scenario.first_scored_step),
        NO_LIMITS if stop_at is None else stop_at.table, (estimates, position, heading),
    )  # fmt: skip
    return Trace(
        scenario.dt_s, poses[: done + 1], estimates[: done + 1, :3], position[1 : done + 1], heading[1 : done + 1]
    )


def _trace_from_two_tags(
    prepared: PreparedDesign, scenario: Scenario, tags: TagMap, poses: np.ndarray, key: np.uint64,
    known_tags: TagMap | None,
) -> Trace:  # fmt: skip
    """A run whose filter starts at the step that brings a second tag; without one, at the first step, told nothing."""
    recording = record_with(prepared.rig, tags, poses, scenario.dt_s, key)
    n, ready = scenario.n_steps, prepared.ready
    found = start_by_two_tags(recording, prepared.robot)
    first, start = 0, start_of(scenario, poses)
    if found is not None and found[0] + 1 < n:
        first, start = found[0] + 1, found[1]
    state = replace(registry.init(ready, start, key), step=first)
    estimates, position, heading = np.empty((n + 1, N_ESTIMATE)), np.empty(n + 1), np.empty(n + 1)
    estimates[first] = state.moments
    track(ready, state, recording, n, estimates, tags if known_tags is None else known_tags)
    pose_errors(poses, estimates, first, n + 1, position, heading)
    return Trace(
        scenario.dt_s, poses[first:], estimates[first:, :3], position[first + 1 :], heading[first + 1 :], first
    )


def run_in_parts(
    track: Callable, key: np.uint64, poses: np.ndarray, rig: Rig, tags: tuple, nominal: tuple, model: tuple,
    known_tags: tuple, arrays: tuple, timing: tuple, limits: tuple, errors: tuple,
) -> int:  # fmt: skip
    """As `_run_kernels.run_mcl`, for the compiled `track` of any estimator; only the loop over looks is not compiled.

    That costs some 30 us per look, which particle filters, run by the million, are spared.
    """
    dt, n_look, _ = timing
    n = poses.shape[0] - 1
    log, rows = kernels.begin(key, poses, rig, n_look, dt)
    done = 0
    while done < n:
        last = min(done + n_look, n)
        kernels.listen(key, poses, done, last, dt, rig, tags, nominal, log, rows)
        track(key, done, last, log, model, known_tags, arrays, errors[0])
        has_failed = kernels.assess(poses, done, last, timing, limits, errors)
        done = last
        if has_failed:
            break
    return done


def score(trace: Trace, scenario: Scenario) -> RunMetrics:
    """Metrics of a traced run."""
    n_done = trace.n_before + trace.position_error_mm.size
    return summarize(
        trace.position_error_mm, trace.heading_error_rad, scenario.dt_s, scenario.first_scored_step,
        is_complete=n_done == scenario.n_steps,
    )  # fmt: skip


def key_of(seed: int, run: int) -> np.uint64:
    """Key of the random streams of a run."""
    return np.uint64(run_key(np.uint64(seed), np.uint64(run)))
