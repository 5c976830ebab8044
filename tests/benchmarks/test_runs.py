"""Whole runs: what truth, reads and statistics add to the filter; how cost grows with tags, runs and cores."""

import json
import subprocess
import sys

import pytest

from rfiddesign.evaluate import evaluate
from rfiddesign.simulation.monte_carlo import Job, Simulator
from tests.benchmarks.board import Row, race
from tests.benchmarks.scene import make_scene

# Run in a process of its own, so that its greatest memory is its own.
TAGS_PROGRAM = """
import json, resource, sys, time
from rfiddesign.floor import rectangle_floor
from rfiddesign.simulation import Scenario
from rfiddesign.simulation.monte_carlo import Job, Simulator
from tests.benchmarks.scene import make_scene
design = make_scene(tags_per_m2=100.0).design
best, runs = {}, {}
for n_tags in (1e3, 1e4, 1e5, 1e6, 1e7):
    side = (n_tags / 100.0) ** 0.5 * 1000.0
    floor = rectangle_floor(side, side, footprint_radius_mm=320)
    simulator = Simulator(Scenario(floor, duration_s=20.0), 1, 1)
    runs[n_tags] = simulator
    list(simulator.runs([Job(design, run) for run in range(2)]))
for _ in range(5):
    for n_tags, simulator in runs.items():
        begin = time.perf_counter()
        list(simulator.runs([Job(design, run) for run in range(20)]))
        took = (time.perf_counter() - begin) / 20 / simulator.scenario.n_steps
        best[n_tags] = min(best.get(n_tags, 9.0), took)
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps({"times": [(n, t * 1e6) for n, t in best.items()], "peak_mb": peak}))
"""


@pytest.mark.parametrize(("layout", "antenna", "bar"), [("cross-8", "60x60", 1.3), ("cross-96", "30x30", 1.6)])
def test_whole_run(benchmark, board, layout, antenna, bar):
    scene = make_scene(layout, antenna, tags_per_m2=100.0)
    with Simulator(scene.scenario, 1, 1) as simulator:
        # The very run that the filter alone is timed on; its true poses are drawn anew each time.
        def whole():
            simulator._poses.cache_clear()
            return list(simulator.runs([Job(scene.design, 0)]))

        best = race({"whole": whole, "filter": scene.track}, 40)
        benchmark.pedantic(whole, rounds=20)
    n_readers = len(scene.design.layout.poses)
    board.rows.append(
        Row(
            f"whole run (route, truth, reads, filter, statistics), {n_readers} readers", "ms", best["whole"] * 1e3,
            {"filter alone": best["filter"] * 1e3}, (("filter alone", bar, False),),
        )
    )  # fmt: skip


def test_two_cores_and_growth_with_runs(benchmark, board):
    scene = make_scene(tags_per_m2=100.0)
    n_runs = 400
    runs = {n: lambda n=n: evaluate(scene.design, scene.scenario, n_runs, seed=1, n_workers=n) for n in (1, 2)}
    best = race(runs, 5)
    benchmark.pedantic(runs[2], rounds=2)
    board.rows.append(Row("400 runs, 2 threads", "s", best[2], {"1 thread": best[1]}, (("1 thread", 1.9, True),)))
    board.curves["cores [runs per s]"] = [(n, n_runs / best[n]) for n in (1, 2)]
    short = make_scene(tags_per_m2=100.0, n_particles=100, duration_s=5.0)
    counts = (1, 10, 100, 1000, 10_000)
    by_count = race({n: lambda n=n: evaluate(short.design, short.scenario, n, seed=1, n_workers=1) for n in counts}, 2)
    board.curves["runs of 100 steps and 100 particles [ms per run]"] = [(n, by_count[n] / n * 1e3) for n in counts]


def test_floor_of_ten_million_tags(benchmark, board):
    done = subprocess.run([sys.executable, "-c", TAGS_PROGRAM], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout.splitlines()[-1])
    times = dict(found["times"])
    benchmark.pedantic(lambda: None)
    board.rows.append(
        Row("step on a floor of 10^7 tags", "us", times[1e7], {"10^3 tags": times[1e3]}, (("10^3 tags", 1.3, False),))
    )
    board.curves["tags [us per step]"] = found["times"]
    board.notes.append(f"Peak memory with floors of 10^3 to 10^7 tags laid: {found['peak_mb']:.0f} MB (bar: 1,000 MB).")
