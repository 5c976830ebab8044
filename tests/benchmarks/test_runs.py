"""Whole runs: what truth, reads and statistics add to the filter; how cost grows with tags, runs and cores."""

import json
import subprocess
import sys

import numpy as np
import pytest

from rfiddesign.evaluate import evaluate
from rfiddesign.simulation.monte_carlo import Job, Simulator
from tests.benchmarks.board import Row, race
from tests.benchmarks.scene import make_scene

# Runs timed together, as a study simulates them.
N_WHOLE = 16
# Run in a process of its own, so that its greatest memory is its own.
TAGS_PROGRAM = """
import json, resource, sys, time
from rfiddesign.floor import rectangle_floor
from rfiddesign.simulation import Scenario
from rfiddesign.simulation.monte_carlo import Job, Simulator
from tests.benchmarks.scene import make_scene
design = make_scene(tags_per_m2=100.0).design
best, runs, peaks = {}, {}, {}
for n_tags in (1e3, 1e4, 1e5, 1e6, 1e7):
    side = (n_tags / 100.0) ** 0.5 * 1000.0
    floor = rectangle_floor(side, side, footprint_radius_mm=320)
    simulator = Simulator(Scenario(floor, duration_s=20.0), 1, 1)
    runs[n_tags] = simulator
    list(simulator.runs([Job(design, run) for run in range(2)]))
    peaks[n_tags] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
for _ in range(5):
    for n_tags, simulator in runs.items():
        begin = time.perf_counter()
        list(simulator.runs([Job(design, run) for run in range(20)]))
        took = (time.perf_counter() - begin) / 20 / simulator.scenario.n_steps
        best[n_tags] = min(best.get(n_tags, 9.0), took)
print(json.dumps({"times": [(n, t * 1e6) for n, t in best.items()], "peaks": list(peaks.items())}))
"""


@pytest.mark.parametrize(("layout", "antenna", "bar"), [("cross-8", "60x60", 1.3), ("cross-96", "30x30", 1.6)])
def test_whole_run(benchmark, board, layout, antenna, bar):
    scenes = [make_scene(layout, antenna, tags_per_m2=100.0, run=run) for run in range(N_WHOLE)]
    with Simulator(scenes[0].scenario, 1, 1) as simulator:
        # The very runs whose recordings the filter alone is timed on, their routes drawn anew each time.
        def whole():
            return list(simulator.runs([Job(scenes[0].design, run) for run in range(N_WHOLE)]))

        def filter_alone():
            return [scene.track() for scene in scenes]

        # Both are the same filter on the same reads.
        for scene, run, estimates in zip(scenes, whole(), filter_alone(), strict=True):
            error = np.hypot(*(estimates[1:, :2] - scene.poses[1:, :2]).T)
            assert run.position_mean_mm == pytest.approx(error.mean(), rel=1e-9)
        best = race({"whole": whole, "filter": filter_alone}, 20)
        benchmark.pedantic(whole, rounds=5)
    n_readers = len(scenes[0].design.layout.poses)
    board.rows.append(
        Row(
            f"whole run (route, truth, reads, filter, statistics), {n_readers} readers", "ms",
            best["whole"] / N_WHOLE * 1e3, {"filter alone": best["filter"] / N_WHOLE * 1e3},
            (("filter alone", bar, False),),
        )
    )  # fmt: skip


def test_two_cores_and_growth_with_runs(benchmark, board):
    scene = make_scene(tags_per_m2=100.0)
    n_runs = 400
    runs = {n: lambda n=n: evaluate(scene.design, scene.scenario, n_runs, seed=1, n_workers=n) for n in (1, 2)}
    assert runs[1]().runs == runs[2]().runs
    best = race(runs, 15)
    benchmark.pedantic(runs[2], rounds=2)
    board.rows.append(Row("400 runs, 2 threads", "s", best[2], {"1 thread": best[1]}, (("1 thread", 1.9, True),)))
    board.curves["cores [runs per s]"] = [(n, n_runs / best[n]) for n in (1, 2)]
    short = make_scene(tags_per_m2=100.0, n_particles=100, duration_s=5.0)
    counts = (1, 10, 100, 1000, 10_000)
    by_count = race({n: lambda n=n: evaluate(short.design, short.scenario, n, seed=1, n_workers=1) for n in counts}, 2)
    board.curves["runs, of 100 steps and 100 particles each [ms per run]"] = [
        (n, by_count[n] / n * 1e3) for n in counts
    ]


def test_floor_of_ten_million_tags(benchmark, board):
    done = subprocess.run([sys.executable, "-c", TAGS_PROGRAM], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout.splitlines()[-1])
    times = dict(found["times"])
    benchmark.pedantic(lambda: None)
    board.rows.append(
        Row("step on a floor of 10^7 tags", "us", times[1e7], {"10^3 tags": times[1e3]}, (("10^3 tags", 1.3, False),))
    )
    board.curves["tags on the floor [us per step]"] = found["times"]
    board.curves["tags on the largest floor so far [MB at most]"] = found["peaks"]
    board.rows.append(
        Row(
            "laying 10^7 tags and running on them",
            "MB",
            found["peaks"][-1][1],
            {"the bar": 1000.0},
            (("the bar", 1, False),),
        )
    )
