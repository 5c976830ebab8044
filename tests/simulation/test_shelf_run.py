"""Runs of shelf designs: each a hall of its own, on the drives that floor designs meet."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rfiddesign.estimators.snapshot import SnapshotMcl
from rfiddesign.floor.scenes import warehouse
from rfiddesign.geometry import se2
from rfiddesign.metrics import percentile
from rfiddesign.models.fingerprint_table import TableGrid
from rfiddesign.models.motion import DifferentialMotion, OmnidirectionalMotion
from rfiddesign.simulation.run import true_poses
from rfiddesign.simulation.scenario import Routes, Scenario, World
from rfiddesign.simulation.shelf_run import (
    AddedUp,
    ShelfDesign,
    ShelfJob,
    ShelfSimulator,
    ShelfTrial,
    shelf_metrics,
    shelf_trace,
)
from rfiddesign.simulation.snapshot_drive import DriveSettings

SCENE_OF = cache(lambda tags_per_m: warehouse(8_000.0, 6_000.0, aisle_mm=1_800.0, tags_per_m=tags_per_m))
SCENARIO = Scenario(
    SCENE_OF(8.0).floor, Routes((300.0,), headings=("along",)), World(OmnidirectionalMotion(20.0, 20.0, 0.05)),
    start="unknown", duration_s=40.0, settle_s=15.0,
)  # fmt: skip
TRIAL = ShelfTrial(
    SCENE_OF, SCENARIO, 3, training=DriveSettings(duration_s=200.0), filter=SnapshotMcl(n_particles=500),
    grid=TableGrid(300.0, 18),
)  # fmt: skip
DESIGN = ShelfDesign(8.0, 4, 2, 4, 50)


def test_the_drive_is_that_of_the_floor_designs_run():
    trace, poses = shelf_trace(TRIAL, ShelfJob(DESIGN, 5)), true_poses(SCENARIO, 3, 5)
    times = np.arange(len(poses)) * SCENARIO.dt_s
    expected = np.column_stack([np.interp(trace.time_s, times, column) for column in poses.T])
    assert np.allclose(trace.true_poses, expected, atol=1e-9)


def test_more_training_and_more_tags_localize_better():
    def mean_error(design):
        return np.median([shelf_metrics(TRIAL, ShelfJob(design, run)).position_mean_mm for run in range(4)])

    good = mean_error(DESIGN)
    assert good < 400
    assert mean_error(replace(DESIGN, tags_per_m=0.2, n_training=1)) > 2 * good


def test_metrics_count_the_errors_from_the_settling_time_on():
    job = ShelfJob(DESIGN, 2)
    trace, metrics = shelf_trace(TRIAL, job), shelf_metrics(TRIAL, job)
    scored = trace.position_error_mm[trace.time_s >= 15.0]
    assert 0 < len(scored) < len(trace.time_s)
    assert metrics.position_mean_mm == pytest.approx(scored.mean())
    assert metrics.position_p95_mm == percentile(scored)
    assert metrics.is_complete


def test_a_run_depends_on_its_number_alone():
    jobs = [ShelfJob(DESIGN, run) for run in (4, 1, 2)]
    with ShelfSimulator(TRIAL, 2) as simulator:
        found = [future.result() for future in [simulator.submit(job) for job in jobs]]
    assert found == [shelf_metrics(TRIAL, job) for job in jobs]
    assert len({metrics.position_mean_mm for metrics in found}) == 3
    assert shelf_metrics(replace(TRIAL, seed=4), jobs[0]) != found[0]


def test_noise_of_steps_adds_up_to_that_of_one():
    """As told for steps of one inquiry, against the sum over its own steps of variances of each."""
    rng = np.random.default_rng(1)
    for motion in (OmnidirectionalMotion(20.0, 30.0, 0.1), DifferentialMotion(12.0, 350.0)):
        ways, turns = rng.uniform(0, 30, 40), rng.uniform(-0.1, 0.1, 40)
        steps = motion.noise(0.05)
        each = [steps @ [1.0, way, abs(turn)] for way, turn in zip(ways, turns, strict=True)]
        one = AddedUp(motion, 0.05, 40).noise(1.0) @ [1.0, ways.sum(), np.abs(turns).sum()]
        assert np.allclose(one, np.sum(each, axis=0))
        assert np.allclose(AddedUp(motion, 0.05, 40, 3.0).noise(1.0), 9 * AddedUp(motion, 0.05, 40).noise(1.0))


def test_antennas_look_around_evenly_within_the_hull():
    for n, spread in ((1, [0.0]), (2, [45.0, -45.0]), (4, [45.0, -45.0, 135.0, -135.0])):
        mountings = np.array(replace(DESIGN, n_pairs=n).mountings(240.0))
        assert np.degrees(mountings[:, 2]) == pytest.approx(spread)
        assert np.allclose(np.hypot(*mountings[:, :2].T), 240.0)
        assert np.allclose(se2.wrap_angle(np.arctan2(mountings[:, 1], mountings[:, 0]) - mountings[:, 2]), 0)


def test_bad_designs_are_refused_by_name():
    with pytest.raises(ValueError, match="n_pairs is 3"):
        replace(DESIGN, n_pairs=3)
    with pytest.raises(ValueError, match="tags_per_m"):
        replace(DESIGN, tags_per_m=math.nan)
    with pytest.raises(ValueError, match="n_training"):
        replace(DESIGN, n_training=0)
