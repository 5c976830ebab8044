"""One step of Monte-Carlo localization, everything included, against numpy and published particle filters."""

import numpy as np
import pytest

from tests.benchmarks.board import Row, race
from tests.benchmarks.peers import (
    N_PEER_STEPS,
    filterpy_resampling,
    numpy_float32,
    particles_bootstrap,
    stonesoup_filter,
)
from tests.benchmarks.scene import make_scene

N_PARTICLES = 512


def mean_error(estimates, scene):
    n = len(estimates)
    return np.hypot(*(estimates[1:, :2] - scene.poses[1:n, :2]).T).mean()


def test_mcl_step(benchmark, board):
    scene = make_scene(n_particles=N_PARTICLES)
    peers = {
        "numpy float32": numpy_float32,
        "particles": particles_bootstrap,
        "stonesoup": stonesoup_filter,
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


def bar(n):
    return {"kind": "bar", "n": n, "spacing_mm": 100.0}


def test_growth_with_particles_and_readers(benchmark, board):
    def curve(points):
        for scene in points.values():
            assert np.isfinite(scene.track()[1:]).all()
        best = race({x: scene.track for x, scene in points.items()}, 5)
        return [(x, best[x] / s.recording.n_steps / s.ready.settings.n_particles * 1e9) for x, s in points.items()]

    by_particles = {
        n: make_scene(n_particles=n, duration_s=10.0) for n in (100, 316, 1000, 3162, 10_000, 31_623, 100_000)
    }
    board.curves["particles [ns per particle-step]"] = curve(by_particles)
    layouts = {
        1: {"kind": "single"},
        2: bar(2),
        4: bar(4),
        8: "cross-8",
        20: "cross-20",
        24: "cross-24",
        96: "cross-96",
    }
    scenes = {n: make_scene(layout, "30x30") for n, layout in layouts.items()}
    board.curves["readers [ns per particle-step]"] = curve(scenes)
    benchmark.pedantic(scenes[96].track, rounds=5)
