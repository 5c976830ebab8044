"""One run: where the robot drives, what its filter makes of it, and when it may be stopped."""

import math

import numpy as np
import pytest
import shapely

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators import mcl
from rfiddesign.estimators.mcl import Mcl
from rfiddesign.estimators.start import KnownStart
from rfiddesign.floor import build_tag_map, floor_from_polygon, rectangle_floor
from rfiddesign.geometry import ListedPattern, make_layout, make_pattern
from rfiddesign.metrics import Requirement, convergence_time
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.robot import Robot
from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.simulation.record import record
from rfiddesign.simulation.run import key_of, prepare, trace_run, true_poses
from rfiddesign.simulation.scenario import Routes, Scenario, World

FLOOR = rectangle_floor(5000.0, 4000.0, 300.0)
QUIET = OmnidirectionalMotion(0.0, 0.0, 0.0)


def a_design(tags_per_m2=100.0, layout="cross-8", antenna_name="60x60"):
    return Design(make_layout(layout), antenna(antenna_name), make_pattern("square", tags_per_m2=tags_per_m2))


# Routes


@pytest.mark.parametrize("run", range(12))
def test_robots_stay_on_the_floor_and_keep_their_speed(run):
    floor = floor_from_polygon(shapely.box(0, 0, 5000, 4000), [shapely.box(1500, 1500, 3000, 2500)], 300.0)
    scenario = Scenario(floor, routes=Routes(speeds_mm_per_s=(50.0, 350.0)), duration_s=40.0)
    poses = true_poses(scenario, 3, run)
    assert poses.shape == (801, 3)
    assert shapely.contains_xy(floor.navigable, poses[:, :2]).all()
    speeds = np.hypot(*np.diff(poses[:, :2], axis=0).T) / scenario.dt_s
    assert any(abs(np.median(speeds[speeds > 1]) - speed) < 1e-6 for speed in (50.0, 350.0))


def test_routes_are_aligned_with_the_lattice_or_oblique_as_asked():
    for share in (0.0, 1.0):
        scenario = Scenario(FLOOR, routes=Routes((200.0,), aligned_share=share), duration_s=10.0)
        for run in range(8):
            moves = np.diff(true_poses(scenario, 1, run)[:, :2], axis=0)
            is_straight = np.hypot(*moves.T) > 0.999 * 200.0 * scenario.dt_s
            along_an_axis = np.abs(moves[is_straight]).min(axis=1) < 1e-6
            assert along_an_axis.size > 20
            assert along_an_axis.mean() == share


def test_a_constant_heading_on_an_aligned_route_is_a_quarter_turn():
    scenario = Scenario(FLOOR, routes=Routes((200.0,), aligned_share=1.0, headings=("constant",)), duration_s=5.0)
    headings = [true_poses(scenario, 1, run)[:, 2] for run in range(30)]
    assert all(np.ptp(heading) == 0 for heading in headings)
    assert {round(heading[0] / (math.pi / 2), 9) for heading in headings} == {0, 1, 2, 3}


def test_runs_differ_and_seeds_differ():
    scenario = Scenario(FLOOR, duration_s=5.0)
    starts = {tuple(true_poses(scenario, seed, run)[0]) for seed in range(5) for run in range(5)}
    assert len(starts) == 25
    assert len({int(key_of(seed, run)) for seed in range(5) for run in range(5)}) == 25


# Localization


def test_with_perfect_odometry_and_a_known_start_the_error_stays_tiny():
    """Nothing for the filter to do; what is left is float32 and the binary angle."""
    scenario = Scenario(FLOOR, Routes((350.0,)), World(QUIET), Mcl(motion=QUIET), duration_s=60.0)
    with Simulator(scenario, 1, 2) as simulator:
        for metrics in simulator.runs(Job(a_design(), run) for run in range(4)):
            assert metrics.position_max_mm < 0.25
            assert metrics.heading_max_rad < 2e-4
            assert metrics.convergence_s == scenario.dt_s
            assert metrics.lost_share == 0.0


def test_nothing_read_is_dead_reckoning():
    """Without tags the error grows as that of the odometry alone: the root of the number of steps."""
    scenario = Scenario(FLOOR, Routes((100.0,)), estimator=Mcl(n_particles=2000), duration_s=60.0)
    design = Design(make_layout("cross-8"), antenna("60x60"), ListedPattern(((1.0, 1.0),)))
    with Simulator(scenario, 2, 2) as simulator:
        ends = [simulator.trace(Job(design, run)).poses[-1] for run in range(30)]
        truth = [true_poses(scenario, 2, run)[-1] for run in range(30)]
    turn = np.angle(np.exp(1j * (np.array(ends) - truth)[:, 2]))
    assert turn.std() == pytest.approx(0.05 * 0.05 * math.sqrt(1200), rel=0.45)


def test_reads_keep_the_error_far_below_dead_reckoning():
    scenario = Scenario(FLOOR, Routes((200.0,)), duration_s=60.0)
    nothing = Design(make_layout("cross-8"), antenna("60x60"), ListedPattern(((1.0, 1.0),)))
    with Simulator(scenario, 2, 2) as simulator:
        means = [
            np.mean([m.position_mean_mm for m in simulator.runs(Job(design, run) for run in range(6))])
            for design in (a_design(), nothing)
        ]
    assert means[0] < 10.0
    assert means[1] > 4 * means[0]


def test_from_an_unknown_start_the_filter_converges_only_with_reinitialization():
    """At least five times the error without it (issue 2, shown by 4)."""
    errors, converged = {}, {}
    for is_on in (True, False):
        scenario = Scenario(
            rectangle_floor(20_000.0, 16_000.0, 300.0), Routes((200.0,)), estimator=Mcl(reinitialize=is_on),
            start="unknown", duration_s=30.0, settle_s=10.0,
        )  # fmt: skip
        with Simulator(scenario, 5, 2) as simulator:
            runs = list(simulator.runs(Job(a_design(), run) for run in range(12)))
        errors[is_on] = np.mean([run.position_mean_mm for run in runs])
        converged[is_on] = np.mean([math.isfinite(run.convergence_s) for run in runs])
    assert converged[True] == 1.0
    assert converged[False] < 0.5
    assert errors[False] > 5 * errors[True]


def kidnapped_errors(is_on, run):
    """Position errors of a robot that is carried off halfway; its odometry does not feel it."""
    scenario = Scenario(FLOOR, Routes((200.0,)), estimator=Mcl(reinitialize=is_on), duration_s=20.0)
    there, here = true_poses(scenario, 8, run), true_poses(scenario, 8, run + 1)
    away = here + np.array([*(2500.0 * np.sign(there[-1, :2] - here[0, :2])), 2.0])
    poses = np.concatenate([there[:200], away[:201]])
    # Tags everywhere, so that the robot may be carried anywhere.
    tags = build_tag_map(make_pattern("square", tags_per_m2=100.0).lay(shapely.box(-6000, -6000, 11_000, 10_000)))
    jump = np.abs(np.diff(poses[:, :2], axis=0)).max(axis=1).argmax()
    assert jump == 199
    return scenario, tags, poses


def test_a_kidnapped_robot_is_found_again():
    for is_on in (True, False):
        found = []
        for run in range(4):
            scenario, tags, poses = kidnapped_errors(is_on, run)
            design, key = a_design(), key_of(8, run)
            recording = record(design, tags, poses, scenario.dt_s, scenario.world, key)
            # The carrying step turns no wheel.
            recording.odometry[199] = 0.0
            ready = mcl.build(scenario.estimator, Robot.of(design, scenario.world.reads), scenario.dt_s)
            estimates = np.empty((401, mcl.N_ESTIMATE))
            mcl.track(ready, mcl.init(ready, KnownStart(tuple(poses[0])), key), recording, 400, estimates)
            estimates = estimates[:, :3]
            error = np.hypot(*(estimates[1:] - poses[1:])[:, :2].T)
            turn = np.abs(np.angle(np.exp(1j * (estimates - poses)[1:, 2])))
            assert error[:199].max() < 50.0
            assert error[199] > 500.0
            found.append(convergence_time(error[200:], turn[200:], scenario.dt_s))
        assert (max(found) < 8.0) == is_on
        assert (min(found) == math.inf) != is_on


def test_staggered_reads_taken_for_fresh_lag_half_a_step_behind():
    """v dt / 2 along the way (findings 1); told their age, the filter is not late."""
    speed, dt = 300.0, 0.1
    lag = {}
    for is_compensated in (True, False):
        scenario = Scenario(
            FLOOR, Routes((speed,), aligned_share=0.0, headings=("constant",)),
            World(reads=ReadModel(polling="staggered")), Mcl(is_age_compensated=is_compensated),
            duration_s=30.0, dt_s=dt,
        )  # fmt: skip
        behind = []
        with Simulator(scenario, 4, 2) as simulator:
            for run in range(8):
                trace = simulator.trace(Job(a_design(), run))
                way = np.diff(trace.true_poses[:, :2], axis=0)
                is_straight = np.hypot(*way.T) > 0.999 * speed * dt
                direction = way[is_straight] / (speed * dt)
                offset = (trace.true_poses - trace.poses)[1:][is_straight, :2]
                behind.append(np.sum(offset * direction, axis=1).mean())
        lag[is_compensated] = np.mean(behind)
    assert lag[False] == pytest.approx(speed * dt / 2, rel=0.15)
    assert abs(lag[True]) < 0.1 * speed * dt / 2


# A large floor


def test_a_floor_of_a_million_tags_reads_as_the_small_patch_around_the_route():
    """Neither what is read nor the random draws of a run depend on tags out of reach."""
    floor = rectangle_floor(4000.0, 3000.0, 300.0)
    world = World(reads=ReadModel(read_probability=0.8, polling="staggered"))
    scenario = Scenario(floor, world=world, duration_s=30.0)
    pattern = make_pattern("square", pitch_mm=100.0)
    patch = build_tag_map(pattern.lay(shapely.box(-500, -500, 4500, 3500)))
    hall = build_tag_map(pattern.lay(shapely.box(-40_000, -50_000, 60_000, 50_000)))
    assert hall.n_tags > 999_000
    assert patch.n_tags < 2500
    for name in ("60x60", "30x30", "80x80"):
        poses, key = true_poses(scenario, 0, 3), key_of(0, 3)
        design = a_design(antenna_name=name)
        small, large = (trace_run(prepare(design, scenario), scenario, tags, poses, key) for tags in (patch, hall))
        assert np.array_equal(small.poses, large.poses)
        assert small.position_error_mm.mean() < 20.0


# Stopped runs

REQUIREMENTS = [
    Requirement((("position_mean_mm", 8.0),)),
    Requirement((("position_rms_mm", 9.0), ("heading_rms_rad", 0.03))),
    Requirement((("position_p95_mm", 15.0),)),
    Requirement((("position_max_mm", 30.0),)),
    Requirement((("lost_share", 0.02),)),
    Requirement((), converged_within_s=2.0),
    Requirement((("heading_p95_rad", 0.05), ("heading_max_rad", 0.3)), converged_within_s=10.0),
]


@pytest.mark.parametrize("requirement", REQUIREMENTS, ids=lambda r: "-".join([name for name, _ in r.limits]) or "time")
@pytest.mark.parametrize("start", ["known", "unknown"])
def test_a_stopped_run_would_have_failed(requirement, start):
    """Whether a run passes is the same with and without stopping; a stopped run is the beginning of the whole one."""
    scenario = Scenario(FLOOR, Routes((100.0, 300.0)), start=start, duration_s=20.0, settle_s=1.0)
    designs = a_design(100.0), a_design(9.0, {"kind": "bar", "n": 2, "spacing_mm": 200.0})
    jobs = [Job(design, run) for design in designs for run in range(5)]
    with Simulator(scenario, 6, 2, stop_at=requirement) as stopping, Simulator(scenario, 6, 2) as completing:
        pairs = list(zip(stopping.runs(jobs), completing.runs(jobs), strict=True))
        assert [requirement.is_met(a) for a, _ in pairs] == [requirement.is_met(b) for _, b in pairs]
        n_stopped = sum(not a.is_complete for a, _ in pairs)
        for job, (stopped, complete) in zip(jobs, pairs, strict=True):
            assert complete.is_complete
            assert complete.n_steps == scenario.n_steps
            assert stopped.is_complete or stopped.n_steps < scenario.n_steps
            if stopped.is_complete:
                assert stopped == complete
            else:
                short, whole = stopping._trace(job, requirement), completing.trace(job)
                assert np.array_equal(short.poses, whole.poses[: stopped.n_steps + 1])
    if start == "unknown":
        assert n_stopped > 0
