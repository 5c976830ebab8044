"""Runs of shelf designs: a robot trained by drives along tagged shelves is localized on a drive of another day.

Run i has a warehouse of its own: its fading, its training drives and what changes over night are drawn from (seed, i),
as every run of a floor design has a floor of its own. The drive on which errors are measured is that of run i of the
floor designs.
"""

import math
import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from rfiddesign import require
from rfiddesign.estimators.snapshot import SnapshotMcl
from rfiddesign.floor.scene import Scene
from rfiddesign.metrics import RunMetrics, summarize
from rfiddesign.models.fingerprint import Smoothing
from rfiddesign.models.fingerprint_table import TableGrid
from rfiddesign.models.motion import Motion
from rfiddesign.models.uhf import UhfField, UhfWorld
from rfiddesign.simulation.run import key_of, true_poses
from rfiddesign.simulation.scenario import Scenario
from rfiddesign.simulation.snapshot_drive import (
    DriveSettings,
    drive_key,
    inquiry_duration_s,
    record_along,
    record_snapshots,
)
from rfiddesign.simulation.snapshot_run import SnapshotTrace, localize, train

#: Directions of the antenna pairs on a robot [deg], by how many there are.
BEARINGS = {1: (0.0,), 2: (45.0, -45.0), 4: (45.0, -45.0, 135.0, -135.0)}
# Days of a world: one of training, one of work.
_TRAINING, _WORK = 1, 2


@dataclass(frozen=True)
class ShelfDesign:
    """What one buys and does to localize by shelves.

    Parameters
    ----------
    tags_per_m : tags per metre of shelf front.
    n_pairs : antenna pairs on a robot: 1 looks ahead, 2 look ahead and to the sides, 4 all around.
    n_cycles : inquiry cycles of a snapshot.
    n_training : training drives.
    k_prime : tags that count in the likelihood of a snapshot.
    """

    tags_per_m: float
    n_pairs: int
    n_cycles: int
    n_training: int
    k_prime: int

    def __post_init__(self) -> None:
        require.positive("tags_per_m", self.tags_per_m)
        if self.n_pairs not in BEARINGS:
            raise ValueError(f"n_pairs is {self.n_pairs!r}, must be one of {', '.join(map(str, BEARINGS))}")
        for name, most in (("n_cycles", 1_000), ("n_training", 1_000), ("k_prime", 100_000)):
            require.count(name, getattr(self, name), at_most=most)

    @property
    def name(self) -> str:
        """The design in a line."""
        drives = "drive" if self.n_training == 1 else "drives"
        return (
            f"{self.tags_per_m:g} tags/m of front, {self.n_pairs} antenna pair{'s' if self.n_pairs > 1 else ''},"
            f" {self.n_training} training {drives}, N = {self.n_cycles}, k' = {self.k_prime}"
        )

    def mountings(self, radius_mm: float) -> tuple[tuple[float, float, float], ...]:
        """Poses (x, y, yaw) of the antenna pairs on a robot, so far from its centre."""
        bearings = (math.radians(bearing) for bearing in BEARINGS[self.n_pairs])
        return tuple((radius_mm * math.cos(yaw), radius_mm * math.sin(yaw), yaw) for yaw in bearings)


@dataclass(frozen=True, eq=False)
class ShelfTrial:
    """How shelf designs are exercised.

    Parameters
    ----------
    scene_of : the warehouse with so many tags per metre of front; its floor must be the scenario's.
    scenario : drives, odometry and settling time, as for floor designs.
    seed : of the study.
    uhf : how antennas read.
    training : training drives; where antennas sit is the designs' own.
    antenna_radius_mm : distance of the antennas from the robot's centre.
    filter : the filter on the robots.
    noise_factor : the filter takes the odometry for so many times as noisy as it is, which keeps its particles apart.
    smoothing, grid : how training is turned into a look-up table.
    """

    scene_of: Callable[[float], Scene]
    scenario: Scenario
    seed: int
    uhf: UhfField = field(default_factory=UhfField)
    training: DriveSettings = field(default_factory=DriveSettings)
    antenna_radius_mm: float = 240.0
    filter: SnapshotMcl = field(default_factory=SnapshotMcl)
    noise_factor: float = 3.0
    smoothing: Smoothing = field(default_factory=Smoothing)
    grid: TableGrid = field(default_factory=TableGrid)


@dataclass(frozen=True)
class ShelfJob:
    """Run number `run` of a design."""

    design: ShelfDesign
    run: int


@dataclass(frozen=True)
class AddedUp:
    """Noise of `n_steps` steps of an odometry, of `dt_s` each, as one step, and `factor` times as large."""

    motion: Motion
    dt_s: float
    n_steps: float
    factor: float = 1.0

    def noise(self, dt_s: float) -> np.ndarray:
        """See `Motion.noise`; the steps' own duration holds, whatever is asked."""
        rates = self.factor**2 * self.motion.noise(self.dt_s)
        rates[:, 0] *= self.n_steps
        return rates


def shelf_trace(trial: ShelfTrial, job: ShelfJob) -> SnapshotTrace:
    """Train, drive and localize: truth and estimate after each inquiry."""
    design, scenario = job.design, trial.scenario
    scene = trial.scene_of(design.tags_per_m)
    # Half of the key: seeds of worlds are below 2^63.
    world_seed = int(key_of(trial.seed, job.run)) >> 1
    trained_in, worked_in = (UhfWorld(scene, trial.uhf, world_seed, day) for day in (_TRAINING, _WORK))
    driving = replace(trial.training, mountings=design.mountings(trial.antenna_radius_mm))
    logs = [
        record_snapshots(trained_in, scene, driving, design.n_cycles, seed=world_seed, day=_TRAINING, number=number)
        for number in range(design.n_training)
    ]
    trained = train(logs, scene.floor.navigable, np.array(driving.mountings), trial.smoothing, trial.grid)
    working = replace(driving, motion=scenario.world.motion, faults=scenario.world.faults)
    poses = true_poses(scenario, trial.seed, job.run)
    log = record_along(worked_in, poses, scenario.dt_s, working, design.n_cycles, drive_key(world_seed, _WORK, 0))
    n_steps = _inquiry_s(design) / scenario.dt_s
    motion = AddedUp(scenario.world.motion, scenario.dt_s, n_steps, trial.noise_factor)
    settings = replace(trial.filter, k_prime=design.k_prime, motion=motion)
    return localize(trained, settings, log, int(drive_key(world_seed, _WORK, 1)))


def shelf_metrics(trial: ShelfTrial, job: ShelfJob) -> RunMetrics:
    """Metrics of a run: errors after each inquiry from the scenario's settling time on.

    A drive that ends before any inquiry counts is not complete.
    """
    trace = shelf_trace(trial, job)
    first = int(np.searchsorted(trace.time_s, trial.scenario.settle_s))
    position, heading = (np.ascontiguousarray(e, float) for e in (trace.position_error_mm, trace.heading_error_rad))
    is_complete = first < len(trace.time_s)
    return summarize(position, heading, _inquiry_s(job.design), first, is_complete=is_complete)


def _inquiry_s(design: ShelfDesign) -> float:
    return inquiry_duration_s(design.n_cycles, design.n_pairs)[0]


class ShelfSimulator:
    """Runs shelf designs on threads; a run's answer depends on (seed, run) and the design alone.

    Parameters
    ----------
    trial : how designs are exercised.
    n_workers : threads; None: one per core.
    """

    def __init__(self, trial: ShelfTrial, n_workers: int | None = None):
        self.trial = trial
        self.n_workers = n_workers or os.cpu_count() or 1
        self._pool = ThreadPoolExecutor(self.n_workers)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def submit(self, job: ShelfJob) -> Future[RunMetrics]:
        """Begin one run and do not wait for it."""
        return self._pool.submit(shelf_metrics, self.trial, job)
