"""The compiled float32 filter errs like the same filter in float64 numpy, and states the same spread."""

import numpy as np
import pytest

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators import mcl
from rfiddesign.estimators.start import KnownStart
from rfiddesign.floor import build_tag_map, rectangle_floor
from rfiddesign.geometry import make_layout, make_pattern
from rfiddesign.models.likelihood import DistanceLikelihood
from rfiddesign.models.robot import Robot
from rfiddesign.simulation import Scenario
from rfiddesign.simulation.record import record
from rfiddesign.simulation.run import key_of, true_poses
from tests.estimators.numpy_mcl import NumpyMcl, track

FLOOR = rectangle_floor(12_000, 10_000, footprint_radius_mm=320)
N_RUNS = 200


def both(kind, tags_per_m2, n_runs, duration_s, n_particles=500):
    """Errors (n_runs, 2 filters, position [mm] and heading [rad]) averaged over each run, and all estimates."""
    settings = mcl.Mcl(likelihood=DistanceLikelihood(kind=kind), n_particles=n_particles)
    scenario = Scenario(FLOOR, estimator=settings, duration_s=duration_s)
    design = Design(make_layout("cross-8"), antenna("60x60"), make_pattern("square", tags_per_m2=tags_per_m2))
    tags = build_tag_map(design.pattern.lay(FLOOR.drivable))
    ready = mcl.build(settings, Robot.of(design, scenario.world.reads), scenario.dt_s)
    n, errors = scenario.n_steps, np.empty((n_runs, 2, 2))
    estimates = np.empty((2, n + 1, mcl.N_ESTIMATE))
    for run in range(n_runs):
        poses, key = true_poses(scenario, 21, run), key_of(21, run)
        recording = record(design, tags, poses, scenario.dt_s, scenario.world, key)
        mcl.track(ready, mcl.init(ready, KnownStart(tuple(poses[0])), key), recording, n, estimates[0])
        rng = np.random.Generator(np.random.PCG64([7, run]))
        track(NumpyMcl(ready, poses[0], rng), recording, 0, n, estimates[1])
        offset = estimates[:, 1:, :3] - poses[1:]
        errors[run, :, 0] = np.hypot(offset[..., 0], offset[..., 1]).mean(axis=1)
        errors[run, :, 1] = np.abs(np.angle(np.exp(1j * offset[..., 2]))).mean(axis=1)
    return errors, estimates


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "tags_per_m2"), [("combination", 100.0), ("combination", 16.0), ("gaussian", 100.0), ("gaussian", 16.0)]
)
def test_mean_errors_over_200_paired_runs_are_within_two_standard_errors(kind, tags_per_m2):
    errors, _ = both(kind, tags_per_m2, N_RUNS, duration_s=7.5)
    difference = errors[:, 0] - errors[:, 1]
    standard_error = difference.std(axis=0, ddof=1) / np.sqrt(N_RUNS)
    assert (np.abs(difference.mean(axis=0)) < 2 * standard_error).all()
    # The comparison is sharp: a filter that is 5 % worse would not pass.
    assert (standard_error < 0.025 * errors[:, 1].mean(axis=0)).all()


def test_spread_and_effective_sample_size_are_those_of_the_twin():
    """With 50,000 particles both are all but exact."""
    _, (compiled, twin) = both("combination", 100.0, 1, duration_s=1.0, n_particles=50_000)
    deviations = np.sqrt(twin[1:, [3, 5, 8]])
    assert np.abs(np.sqrt(compiled[1:, [3, 5, 8]]) / deviations - 1).max() < 0.05
    for column, (a, b) in ((4, (0, 1)), (6, (0, 2)), (7, (1, 2))):
        correlations = compiled[1:, column] - twin[1:, column]
        assert np.abs(correlations / (deviations[:, a] * deviations[:, b])).max() < 0.05
    assert np.abs(compiled[1:, 9] / twin[1:, 9] - 1).max() < 0.03
