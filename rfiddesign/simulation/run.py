"""One run: a robot of a design drives a route while its filter listens."""

from dataclasses import dataclass

import numpy as np

from rfiddesign.design import Design
from rfiddesign.estimators import mcl
from rfiddesign.estimators.start import KnownStart, Start, UnknownStart
from rfiddesign.floor import TagMap, random_route
from rfiddesign.metrics import Requirement, RunMetrics, has_certainly_failed, summarize
from rfiddesign.models._noise_kernels import run_key
from rfiddesign.simulation import _recording_kernels as kernels
from rfiddesign.simulation.record import record
from rfiddesign.simulation.scenario import Scenario
from rfiddesign.simulation.trajectory import drive, route_length_mm

# Steps between two looks at whether the run has certainly failed.
STEPS_PER_LOOK = 100
# Keeps a run's route apart from whatever else is drawn from the study's seed, such as the tags of a random pattern.
ROUTE_STREAM = 1


@dataclass(frozen=True)
class Trace:
    """One run step by step: truth and estimate (n_steps + 1, 3), and the errors after each step (n_steps,)."""

    dt_s: float
    true_poses: np.ndarray
    poses: np.ndarray
    position_error_mm: np.ndarray
    heading_error_rad: np.ndarray


def true_poses(scenario: Scenario, seed: int, run: int) -> np.ndarray:
    """Poses (n_steps + 1, 3) of run `run`, the same for every design."""
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(ROUTE_STREAM, run))))
    routes = scenario.routes
    is_aligned = bool(rng.random() < routes.aligned_share)
    speed = float(rng.choice(np.asarray(routes.speeds_mm_per_s)))
    manner = routes.headings[int(rng.integers(len(routes.headings)))]
    turn = float(rng.random())
    heading = None
    if manner == "constant":
        heading = np.floor(4 * turn) * np.pi / 2 if is_aligned else 2 * np.pi * turn
    waypoints = random_route(scenario.floor, rng, route_length_mm(speed, scenario.duration_s), is_aligned=is_aligned)
    times = np.arange(scenario.n_steps + 1) * scenario.dt_s
    return drive(waypoints, speed, heading, routes.turn_rate_rad_per_s, times)


def start_of(scenario: Scenario, poses: np.ndarray) -> Start:
    """What the filter is told before the first step."""
    if scenario.start == "known":
        return KnownStart(tuple(poses[0]))
    return UnknownStart(tuple(scenario.floor.navigable.bounds))


def trace_run(
    design: Design, scenario: Scenario, tags: TagMap, poses: np.ndarray, key: np.uint64,
    stop_at: Requirement | None = None,
) -> Trace:  # fmt: skip
    """Simulate one run and the filter on it; the trace ends early once the run has certainly failed `stop_at`."""
    n = scenario.n_steps
    model = mcl.build(scenario.estimator, design.layout, design.antenna.area, scenario.dt_s)
    recording = record(design, tags, poses, scenario.dt_s, scenario.world, key)
    state = mcl.init(model, start_of(scenario, poses), key)
    estimates = np.empty((n + 1, mcl.N_ESTIMATE))
    estimates[0] = state.moments
    position, heading = np.empty(n + 1), np.empty(n + 1)
    done = 0
    while done < n:
        last = n if stop_at is None else min(done + STEPS_PER_LOOK, n)
        state = mcl.track(model, state, recording, last, estimates)
        kernels.pose_errors(poses, estimates, done + 1, last + 1, position, heading)
        done = last
        if stop_at is not None and done < n:
            errors = (position[1 : done + 1], heading[1 : done + 1])
            if has_certainly_failed(stop_at, *errors, scenario.dt_s, scenario.first_scored_step, n):
                break
    return Trace(
        scenario.dt_s, poses[: done + 1], estimates[: done + 1, :3], position[1 : done + 1], heading[1 : done + 1]
    )


def score(trace: Trace, scenario: Scenario) -> RunMetrics:
    """Metrics of a traced run."""
    n_done = trace.position_error_mm.size
    return summarize(
        trace.position_error_mm, trace.heading_error_rad, scenario.dt_s, scenario.first_scored_step,
        is_complete=n_done == scenario.n_steps,
    )  # fmt: skip


def key_of(seed: int, run: int) -> np.uint64:
    """Key of the random streams of a run."""
    return np.uint64(run_key(np.uint64(seed), np.uint64(run)))
