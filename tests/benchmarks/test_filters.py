"""The other estimators: Kalman filters against numpy and filterpy, the field filter against plain MCL, the grid."""

import math
import time

import numpy as np
import pytest

from rfiddesign.catalog import antenna
from rfiddesign.estimators import ekf, markov, mcl, particle_filter, pmg, registry
from rfiddesign.estimators.start import KnownStart
from rfiddesign.floor import build_tag_map
from rfiddesign.geometry import Disc, compose, listed
from rfiddesign.models.motion import DifferentialMotion, OmnidirectionalMotion
from rfiddesign.models.recording import Recording
from rfiddesign.models.robot import Robot
from rfiddesign.reproduce.cases import case_of
from rfiddesign.reproduce.load import load_reproduction
from rfiddesign.reproduce.measure import measure
from tests.benchmarks.board import Row, race
from tests.benchmarks.scene import FLOOR, make_scene

N_STEPS, N_PEER_STEPS, DT = 2_000, 500, 0.05
# Our filter drives so often in a round, so that it is not the memory of a cold start that is timed.
N_DRIVES = 20
MOTION = OmnidirectionalMotion(20.0, 20.0, 0.05)
MOUNT, RADIUS, VARIANCE = np.array([150.0, 40.0, 0.3]), 30.0, 400.0


def one_read_per_step(n):
    """Reads of tags 45 mm from an antenna that sees 30 mm, so that every one is an update."""
    rng = np.random.default_rng(4)
    odometry = np.tile([5.0, 0.5, 0.01], (n, 1))
    pose, tags = np.zeros(3), np.empty((n, 2))
    for t in range(n):
        pose = compose(pose, odometry[t])
        angle = rng.uniform(0, 2 * math.pi)
        tags[t] = compose(pose, MOUNT)[:2] + 45.0 * np.array([math.cos(angle), math.sin(angle)])
    steps = np.arange(n + 1)
    return Recording(
        DT, np.zeros((n + 1, 3)), odometry, steps, np.zeros(n, np.int32), np.zeros(n, np.int64), tags, np.zeros(n)
    )


class NumpyEkf:
    """The quantized filter in 3 x 3 matrices, as whoever knows numpy writes it."""

    def __init__(self):
        self.x, self.P = np.zeros(3), np.diag([1.0, 1.0, 1e-6])
        self.Q = np.diag(np.array([20.0, 20.0, 0.05]) * DT) ** 2
        self.R = np.eye(2) * (RADIUS**2 / 4 + VARIANCE)
        yaw = MOUNT[2]
        self.turn = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
        self.eye = np.eye(3)

    def jacobian_of_motion(self, u):
        s, c = math.sin(self.x[2]), math.cos(self.x[2])
        G = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        F = np.array([[1.0, 0.0, -s * u[0] - c * u[1]], [0.0, 1.0, c * u[0] - s * u[1]], [0.0, 0.0, 1.0]])
        return F, G

    def measured(self, x, tag):
        s, c = math.sin(x[2]), math.cos(x[2])
        R = np.array([[c, s], [-s, c]])
        p = R @ (tag - x[:2])
        return self.turn @ (p - MOUNT[:2]), R, p

    def jacobian(self, x, tag):
        _, R, p = self.measured(x, tag)
        H = np.empty((2, 3))
        H[:, :2] = -self.turn @ R
        H[:, 2] = self.turn @ np.array([p[1], -p[0]])
        return H

    def step(self, u, tag):
        F, G = self.jacobian_of_motion(u)
        self.x = self.x + G @ u
        self.P = F @ self.P @ F.T + G @ self.Q @ G.T
        z, R, p = self.measured(self.x, tag)
        if z @ z <= RADIUS**2:
            return
        H = np.empty((2, 3))
        H[:, :2] = -self.turn @ R
        H[:, 2] = self.turn @ np.array([p[1], -p[0]])
        PH = self.P @ H.T
        K = PH @ np.linalg.inv(H @ PH + self.R)
        self.x = self.x - K @ z
        self.P = (self.eye - K @ H) @ self.P


def numpy_ekf(recording):
    twin, out = NumpyEkf(), np.empty((N_PEER_STEPS, 3))
    for t in range(N_PEER_STEPS):
        twin.step(recording.odometry[t], recording.read_tag_mm[t])
        out[t] = twin.x
    return out


def filterpy_ekf(recording):
    kalman = pytest.importorskip("filterpy.kalman")
    twin, out = NumpyEkf(), np.empty((N_PEER_STEPS, 3))
    filter_ = kalman.ExtendedKalmanFilter(dim_x=3, dim_z=2)
    filter_.x, filter_.P, filter_.R = np.zeros(3), twin.P, twin.R
    for t in range(N_PEER_STEPS):
        u, tag = recording.odometry[t], recording.read_tag_mm[t]
        twin.x = filter_.x
        filter_.F, G = twin.jacobian_of_motion(u)
        filter_.Q = G @ twin.Q @ G.T
        filter_.P = filter_.F @ filter_.P @ filter_.F.T + filter_.Q
        filter_.x = filter_.x + G @ u
        z = twin.measured(filter_.x, tag)[0]
        if z @ z > RADIUS**2:
            filter_.update(
                np.zeros(2), lambda x, tag: twin.jacobian(x, tag), lambda x, tag: twin.measured(x, tag)[0], args=(tag,),
                hx_args=(tag,),
            )  # fmt: skip
        out[t] = filter_.x
    return out


def test_ekf_step(benchmark, board):
    recording = one_read_per_step(N_STEPS)
    ready = ekf.build(ekf_settings(), Robot(listed([tuple(MOUNT)]), Disc(RADIUS)), DT)
    estimates = np.empty((N_STEPS + 1, ekf.N_ESTIMATE))

    def ours():
        for _ in range(N_DRIVES):
            ekf.track(ready, ekf.init(ready, KnownStart((0.0, 0.0, 0.0)), 0), recording, N_STEPS, estimates)

    peers = {"numpy 3x3": numpy_ekf, "filterpy": filterpy_ekf}
    # Who is fast must also be right.
    ours()
    for name, peer in peers.items():
        found = peer(recording)
        assert found[:, :2] == pytest.approx(estimates[1 : N_PEER_STEPS + 1, :2], abs=1e-3), name
    best = race({"ours": ours, **{name: lambda peer=peer: peer(recording) for name, peer in peers.items()}}, 15)
    benchmark.pedantic(ours, rounds=10)
    board.rows.append(
        Row(
            "EKF step with one read",
            "us",
            best["ours"] / N_STEPS / N_DRIVES * 1e6,
            {name: best[name] / N_PEER_STEPS * 1e6 for name in peers},
            (("numpy 3x3", 100, True), ("filterpy", 300, True)),
        )
    )


def ekf_settings():
    return ekf.Ekf("quantized", MOTION, read_noise_mm=math.sqrt(VARIANCE), patience=0)


def test_particle_filter_that_learns_from_nothing(benchmark, board):
    scene = make_scene(tags_per_m2=100.0)
    tags = build_tag_map(scene.design.pattern.lay(FLOOR.drivable))
    robot = Robot.of(scene.design, scene.scenario.world.reads)
    settings = particle_filter.ParticleFilter(n_particles=scene.n_particles)
    ready = particle_filter.build(settings, robot, scene.scenario.dt_s)
    n = scene.recording.n_steps
    estimates = np.empty((n + 1, mcl.N_ESTIMATE))

    def ours():
        state = particle_filter.init(ready, KnownStart(tuple(scene.poses[0])), 0)
        particle_filter.track(ready, state, scene.recording, n, estimates, tags)

    ours()
    errors = [np.hypot(*(found[1:, :2] - scene.poses[1:, :2]).T).mean() for found in (estimates, scene.track())]
    assert errors[0] < errors[1]
    best = race({"ours": ours, "plain MCL": scene.track}, 15)
    benchmark.pedantic(ours, rounds=10)
    to_ns = 1e9 / n / scene.n_particles
    board.rows.append(
        Row(
            f"particle filter with what 8 antennas did not read, {scene.n_particles} particles",
            "ns per particle-step",
            best["ours"] * to_ns,
            {"plain MCL": best["plain MCL"] * to_ns},
            (("plain MCL", 3, False),),
        )
    )


@pytest.mark.parametrize(
    ("what", "settings", "tags_per_m2", "bar_us"),
    [("while tracking", pmg.Pmg(), 100.0, 10.0), ("with splitting", pmg.Pmg(split_sigma=0.1), 16.0, 15.0)],
)
def test_pmg_step(benchmark, board, what, settings, tags_per_m2, bar_us):
    """Against the particle filter that errs as much: of 500 particles, within a few per cent on most drives."""
    scene = make_scene(tags_per_m2=tags_per_m2)
    tags = build_tag_map(scene.design.pattern.lay(FLOOR.drivable))
    robot, n = Robot.of(scene.design, scene.scenario.world.reads), scene.recording.n_steps
    estimates = np.empty((n + 1, mcl.N_ESTIMATE))
    errors = {}

    def drive_of(filter_):
        ready = registry.build(filter_, robot, scene.scenario.dt_s)

        def drive():
            state = registry.init(ready, KnownStart(tuple(scene.poses[0])), 0)
            return pmg.track(ready, state, scene.recording, n, estimates, tags)

        state = drive()
        errors[type(filter_)] = np.hypot(*(estimates[1:, :2] - scene.poses[1:, :2]).T).mean()
        return drive, state

    ours, _ = drive_of(settings)
    particles, _ = drive_of(particle_filter.ParticleFilter(softness_mm=settings.softness_mm))
    # Who is fast must also be right.
    assert errors[pmg.Pmg] < 1.15 * errors[particle_filter.ParticleFilter]
    best = race({"ours": ours, "particles": particles}, 25)
    benchmark.pedantic(ours, rounds=10)
    board.rows.append(
        Row(
            f"PMG step of 8 antennas {what}, {tags_per_m2:g} tags/m2",
            "us",
            best["ours"] / n * 1e6,
            {"the bar": bar_us, "particle filter of 500": best["particles"] / n * 1e6},
            (("the bar", 1, False), *([("particle filter of 500", 10, True)] if what == "while tracking" else [])),
        )
    )


def test_markov_step(benchmark, board):
    """The grid of the paper, with a read, and thus a blur, in every step."""
    n, area = 400, antenna("smart-floor").area
    rng = np.random.default_rng(6)
    odometry = np.tile([10.0, 0.0, 0.0], (n, 1)) + rng.normal(0, (0.5, 0.0, 0.002), (n, 3))
    tags = np.column_stack([10.0 * np.arange(1, n + 1), np.zeros(n)]) + rng.normal(0, 40.0, (n, 2))
    recording = Recording(
        DT, np.zeros((n + 1, 3)), odometry, np.arange(n + 1), np.zeros(n, np.int32), np.zeros(n, np.int64), tags,
        np.zeros(n),
    )  # fmt: skip
    ready = markov.build(markov.Markov(DifferentialMotion(30.0)), Robot(listed([(0.0, 0.0, 0.0)]), area), DT)
    estimates = np.empty((n + 1, mcl.N_ESTIMATE))

    def ours():
        markov.track(ready, markov.init(ready, KnownStart((0.0, 0.0, 0.0)), 0), recording, n, estimates)

    best = race({"ours": ours}, 7)
    # The robot drives along x, and the grid must have followed it.
    assert np.abs(estimates[1:, 0] - 10.0 * np.arange(1, n + 1)).max() < 100.0
    benchmark.pedantic(ours, rounds=5)
    board.rows.append(
        Row(
            "Markov step, 141 x 141 cells, a read in every step",
            "us",
            best["ours"] / n * 1e6,
            {"the bar": 1000.0},
            (("the bar", 1, False),),
        )
    )


def test_kalman_filters_of_a_whole_study(benchmark, board):
    """200 seeds of the seven filters of rssi-kalman-navifloor on the published path, kernels on disk."""
    loaded = load_reproduction("rssi-kalman-navifloor")
    rows = [row for row in loaded.file.rows if row.table == "table II"][:7]
    cases = [case_of(loaded, row) for row in rows]
    for case in cases:
        measure(case, 1, 1, 2, lambda: None)

    def all_filters():
        return [measure(case, 200, 1, 2, lambda: None)["rmse_mm"].mean() for case in cases]

    begin = time.perf_counter()
    errors = benchmark.pedantic(all_filters, rounds=1)
    assert 20.0 < min(errors) < max(errors) < 100.0
    seconds = time.perf_counter() - begin
    board.rows.append(
        Row("200 seeds x 7 filters of rssi-kalman-navifloor, 2 threads", "s", seconds, {"the bar": 60.0},
            (("the bar", 1, False),))
    )  # fmt: skip
