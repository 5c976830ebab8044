"""Runs of other estimators than the paper's: the same run in compiled parts, and what they make of it."""

from functools import partial

import numpy as np
import pytest

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators import registry, verbs
from rfiddesign.estimators.mcl import Mcl
from rfiddesign.estimators.particle_filter import ParticleFilter
from rfiddesign.floor import build_tag_map, rectangle_floor
from rfiddesign.geometry import make_layout, make_pattern
from rfiddesign.metrics import NO_LIMITS, Requirement
from rfiddesign.models.motion import MecanumMotion, OdometryFaults
from rfiddesign.models.reads import ReadModel
from rfiddesign.simulation import _run_kernels as kernels
from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.simulation.record import installed
from rfiddesign.simulation.run import key_of, prepare, run_in_parts, start_of, true_poses
from rfiddesign.simulation.scenario import Routes, Scenario, World

FLOOR = rectangle_floor(5000.0, 4000.0, 300.0)


def a_design(tags_per_m2=100.0, layout="cross-8", antenna_name="60x60", kind="square"):
    return Design(make_layout(layout), antenna(antenna_name), make_pattern(kind, tags_per_m2=tags_per_m2))


def both_ways(design, scenario, run, stop_at=None):
    """Errors and estimates of a run by the compiled loop and by the loop over its compiled parts."""
    prepared, n = prepare(design, scenario), scenario.n_steps
    poses, key = true_poses(scenario, 3, run), key_of(3, run)
    tags = build_tag_map(design.pattern.lay(scenario.floor.drivable))
    state = registry.init(prepared.ready, start_of(scenario, poses), key)
    found = []
    for drive_on in (kernels.run_mcl, partial(run_in_parts, prepared.ready.kernels.track)):
        errors = tuple(np.full(shape, -1.0) for shape in ((n + 1, verbs.N_ESTIMATE), n + 1, n + 1))
        done = drive_on(
            key, poses, prepared.rig, installed(tags), (tags.nominal_x, tags.nominal_y), prepared.ready.model,
            verbs.known(tags), verbs.workspace(state), (scenario.dt_s, 100, 0),
            NO_LIMITS if stop_at is None else stop_at.table, errors,
        )  # fmt: skip
        found.append((done, *errors))
    return found


@pytest.mark.parametrize("stop_at", [None, Requirement((("position_mean_mm", 3.0),))], ids=["whole", "stopped"])
@pytest.mark.parametrize("start", ["known", "unknown"])
@pytest.mark.parametrize(
    "estimator", [Mcl(), ParticleFilter(uses_rssi=True), ParticleFilter(learns_from_nothing=False)], ids=repr
)
def test_a_run_in_parts_equals_the_compiled_run_bit_for_bit(estimator, start, stop_at):
    """Of 250 steps, which are no whole number of looks."""
    reads = ReadModel(0.9, "multiplexed", 0.02, 0.02, 0.04, "all")
    world = World(MecanumMotion(), reads, 4.0, OdometryFaults(0.01, 0.02, 0.01, 0.1, 5.0))
    scenario = Scenario(FLOOR, Routes((300.0,)), world, estimator, start, duration_s=12.5)
    design = a_design(25.0, {"kind": "bar", "n": 3, "spacing_mm": 150.0}, "navifloor")
    n_stopped = 0
    for run in range(3):
        compiled, in_parts = both_ways(design, scenario, run, stop_at)
        n_stopped += compiled[0] < scenario.n_steps
        for a, b in zip(compiled, in_parts, strict=True):
            assert np.array_equal(a, b)
    assert (n_stopped > 0) == (stop_at is not None)


def mean_errors(scenario, design, n_runs=12):
    with Simulator(scenario, 3, 2) as simulator:
        return np.array([m.position_mean_mm for m in simulator.runs(Job(design, run) for run in range(n_runs))])


def test_no_reads_make_the_particle_filter_better_than_the_paper_s():
    """Paired over runs (findings of prototypes: 2.7 mm against 4.0 at 100 tags/m2)."""
    errors = [
        mean_errors(
            Scenario(FLOOR, Routes((200.0,), aligned_share=0.0), estimator=estimator, duration_s=20.0), a_design()
        )
        for estimator in (Mcl(), ParticleFilter(learns_from_nothing=False), ParticleFilter())
    ]
    assert errors[2].mean() < 0.8 * errors[1].mean()
    assert errors[2].mean() < 0.75 * errors[0].mean()


@pytest.mark.parametrize("estimator", [Mcl(), ParticleFilter()], ids=lambda e: type(e).__name__)
def test_a_robot_finds_its_way_over_a_random_pattern_as_well(estimator):
    """About as precisely as over a lattice as dense; from anywhere it finds itself."""
    means = {}
    for kind in ("random", "square"):
        design = a_design(kind=kind)
        means[kind] = mean_errors(Scenario(FLOOR, Routes((200.0,)), estimator=estimator, duration_s=20.0), design, 6)
        lost = Scenario(FLOOR, Routes((200.0,)), estimator=estimator, start="unknown", duration_s=30.0, settle_s=20.0)
        assert np.median(mean_errors(lost, design, 6)) < 2 * means[kind].mean()
    assert means["random"].mean() < 1.6 * means["square"].mean()
