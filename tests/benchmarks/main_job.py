"""Where the processor time of the main job goes: `python -m tests.benchmarks.main_job OUT` prints one JSON object.

One worker; functions that together make up the job are timed by their thread's clock, and what none of them accounts
for is left over.  Filter steps are compiled into the run: their share of it is measured afterwards, by the filter alone
on recordings of a sample of the job's own runs.
"""

import contextlib
import importlib
import io
import json
import sys
import threading
import time
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

STUDY = Path(__file__).parents[2] / "studies" / "willow-office"
# Runs of the sample.
N_SAMPLED = 150
# (module, function, what it is): none calls another of them.
PARTS = (
    ("rfiddesign.simulation.run", "kernels.run_mcl", "runs: truth, reads, filter, errors (compiled)"),
    ("rfiddesign.simulation.monte_carlo", "true_poses", "routes"),
    ("rfiddesign.simulation.monte_carlo", "score", "statistics of runs"),
    ("rfiddesign.simulation.monte_carlo", "InstalledTags.lay", "laying tags"),
    ("rfiddesign.optimize.screen", "coverage", "screens: what antennas see"),
    ("rfiddesign.report", "write_report", "report and figures"),
    ("rfiddesign.study.run_study", "floor_of", "reading the map"),
    ("rfiddesign.study.run_study", "sensitivity", "how the floor depends on thresholds"),
    ("rfiddesign.study.run_study", "study_result", "coverage and tables of the answer"),
)


class Clock:
    """Processor time by part."""

    def __init__(self):
        self.seconds = Counter()
        self.calls = []
        self._lock = threading.Lock()

    def watch(self, module: str, name: str, part: str) -> None:
        """Time every call of a function of a module, or of a class or namespace in it."""
        owner = importlib.import_module(module)
        *path, name = name.split(".")
        for step in path:
            if step == "kernels":
                # Compiled functions are called through a copy of their module.
                setattr(owner, step, SimpleNamespace(**vars(getattr(owner, step))))
            owner = getattr(owner, step)
        function = getattr(owner, name)

        def timed(*arguments, **options):
            begin = time.thread_time()
            try:
                return function(*arguments, **options)
            finally:
                with self._lock:
                    self.seconds[part] += time.thread_time() - begin

        setattr(owner, name, timed)


def filter_share_of_runs(out: Path) -> float:
    """Time of the filter alone over that of whole runs, on the first run of designs spread over those tested."""
    import numpy as np

    from rfiddesign.estimators import mcl
    from rfiddesign.simulation import run as runs
    from rfiddesign.simulation.monte_carlo import Simulator
    from rfiddesign.simulation.record import record
    from rfiddesign.study import load_study
    from rfiddesign.study.load import floor_of, scenario_of, space_of
    from rfiddesign.study.pipeline import loosest
    from rfiddesign.study.storage import RunTable

    study = load_study(STUDY)
    designs, seed = space_of(study).designs(), study.file.seed
    scenario, stop_at = scenario_of(study, floor_of(study)), loosest(study)
    with RunTable(out / "runs.sqlite") as table:
        jobs = [(number, run) for (_, number), stored in table.runs().items() for run in range(len(stored))]
    whole = alone = 0.0
    with Simulator(scenario, seed, 1) as simulator:
        for number, run in jobs[:: max(1, len(jobs) // N_SAMPLED)]:
            design = designs[number]
            prepared, tags = runs.prepare(design, scenario), simulator.tags(design.pattern)
            poses, key = runs.true_poses(scenario, seed, run), runs.key_of(seed, run)
            begin = time.thread_time()
            trace = runs.trace_run(prepared, scenario, tags, poses, key, stop_at)
            whole += time.thread_time() - begin
            recording = record(design, tags, poses, scenario.dt_s, scenario.world, key)
            state = mcl.init(prepared.ready, runs.start_of(scenario, poses), key)
            estimates = np.empty((scenario.n_steps + 1, mcl.N_ESTIMATE))
            begin = time.thread_time()
            mcl.track(prepared.ready, state, recording, trace.position_error_mm.size, estimates)
            alone += time.thread_time() - begin
    return alone / whole


def main(out: Path) -> None:
    """Run the main job and print where its time went."""
    clock = Clock()
    for module, name, part in PARTS:
        clock.watch(module, name, part)
    from rfiddesign.cli import main as command_line

    n_before = time.process_time()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        command_line(["run", str(STUDY), "--out", str(out), "--workers", "1"])
    total = time.process_time()
    parts = {"interpreter and imports": n_before} | dict(clock.seconds.most_common())
    parts["all else: search, storage, threads"] = total - sum(parts.values())
    print(json.dumps({"total_s": total, "parts_s": parts, "filter_share_of_runs": filter_share_of_runs(out)}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
