"""One step of Monte-Carlo localization, everything included, against numpy and published particle filters."""

import numpy as np
import pytest

from rfiddesign.estimators import mcl
from tests.benchmarks.board import Row, race
from tests.benchmarks.scene import make_scene
from tests.estimators.numpy_mcl import NumpyMcl, track

N_PARTICLES, N_PEER_STEPS = 512, 200


def numpy_float32(scene, twin_class=NumpyMcl):
    """Estimates of the numpy filter over the first steps of the recording."""
    estimates = np.empty((N_PEER_STEPS + 1, mcl.N_ESTIMATE))
    twin = twin_class(scene.model, scene.poses[0], np.random.Generator(np.random.SFC64(3)), np.float32)
    track(twin, scene.recording, 0, N_PEER_STEPS, estimates)
    return estimates


def particles_bootstrap(scene):
    """The bootstrap filter of the package `particles` (Chopin) with its systematic resampling and moments."""
    particles = pytest.importorskip("particles")
    from particles.collectors import Moments

    recording, model = scene.recording, scene.model
    inner, tail = model.rules[:2]
    rng = np.random.Generator(np.random.SFC64(3))

    class Localization(particles.FeynmanKac):
        def M0(self, N):
            return np.tile(scene.poses[0], (N, 1))

        def M(self, t, xp):
            d = recording.odometry[t - 1] + model.deviations * rng.standard_normal(xp.shape)
            cosine, sine = np.cos(xp[:, 2]), np.sin(xp[:, 2])
            moved = np.empty_like(xp)
            moved[:, 0] = xp[:, 0] + cosine * d[:, 0] - sine * d[:, 1]
            moved[:, 1] = xp[:, 1] + sine * d[:, 0] + cosine * d[:, 1]
            moved[:, 2] = xp[:, 2] + d[:, 2]
            return moved

        def logG(self, t, xp, x):
            log_weights = np.zeros(len(x))
            if t == 0:
                return log_weights
            cosine, sine = np.cos(x[:, 2]), np.sin(x[:, 2])
            for row in range(recording.read_start[t - 1], recording.read_start[t]):
                a, (tag_x, tag_y) = recording.read_antenna[row], recording.read_tag_mm[row]
                dx, dy = tag_x - x[:, 0], tag_y - x[:, 1]
                z = np.stack([cosine * dx + sine * dy, cosine * dy - sine * dx]) - model.positions_mm[a][:, None]
                squared = ((model.whitening[a] @ z) ** 2).sum(axis=0)
                log_weights += np.where(squared < inner * inner, 0.0, tail - 0.5 * squared)
            return log_weights

    filter_ = particles.SMC(
        fk=Localization(T=N_PEER_STEPS + 1), N=N_PARTICLES, resampling="systematic", ESSrmin=1.0, collect=[Moments()]
    )
    filter_.run()
    return np.array([moments["mean"] for moments in filter_.summaries.moments])


def filterpy_resampling(scene):
    """The same numpy filter with `filterpy`'s systematic resampling, as its handbook shows."""
    resample = pytest.importorskip("filterpy.monte_carlo").systematic_resample

    class WithFilterpy(NumpyMcl):
        def _resample(self, weights, total, log_weights, antenna, tags):
            drawn = resample((weights / total).astype(float))
            self.x, self.y, self.heading = self.x[drawn], self.y[drawn], self.heading[drawn]

    return numpy_float32(scene, WithFilterpy)


def mean_error(estimates, scene):
    n = len(estimates)
    return np.hypot(*(estimates[1:, :2] - scene.poses[1:n, :2]).T).mean()


def test_mcl_step(benchmark, board):
    scene = make_scene(n_particles=N_PARTICLES)
    peers = {
        "numpy float32": numpy_float32,
        "particles": particles_bootstrap,
        "filterpy resampling": filterpy_resampling,
    }
    # Who is fast must also be right.
    ours = mean_error(scene.track()[: N_PEER_STEPS + 1], scene)
    for name, peer in peers.items():
        assert mean_error(peer(scene), scene) == pytest.approx(ours, rel=0.35), name
    best = race({"ours": scene.track, **{name: lambda peer=peer: peer(scene) for name, peer in peers.items()}}, 7)
    benchmark.pedantic(scene.track, rounds=20)
    to_ns = 1e9 / N_PARTICLES
    board.rows.append(
        Row(
            f"MCL step, 512 particles, 8 readers, {scene.reads_per_step:.1f} detections per step",
            "ns per particle-step",
            best["ours"] / scene.recording.n_steps * to_ns,
            {name: best[name] / N_PEER_STEPS * to_ns for name in peers},
            (("numpy float32", 25, True), ("particles", 100, True)),
        )
    )


def test_growth_with_particles_and_readers(benchmark, board):
    def curve(points):
        best = race({x: scene.track for x, scene in points.items()}, 5)
        return [(x, best[x] / s.recording.n_steps / s.model.settings.n_particles * 1e9) for x, s in points.items()]

    by_particles = {
        n: make_scene(n_particles=n, duration_s=10.0) for n in (100, 316, 1000, 3162, 10_000, 31_623, 100_000)
    }
    board.curves["particles [ns per particle-step]"] = curve(by_particles)
    by_readers = {8: "cross-8", 20: "cross-20", 24: "cross-24", 96: "cross-96"}
    by_readers |= {n: {"kind": "bar", "n": n, "spacing_mm": 100.0} for n in (2, 4)}
    scenes = {n: make_scene(layout, "30x30") for n, layout in by_readers.items()}
    board.curves["readers [ns per particle-step]"] = curve(scenes)
    benchmark.pedantic(scenes[96].track, rounds=5)
