"""Where the time of the main job goes."""

import json
import subprocess
import sys
from pathlib import Path

from tests.benchmarks.board import Share

ROOT = Path(__file__).parents[2]


def test_main_job(benchmark, board, tmp_path):
    """After one run that compiles what is not on disk yet."""
    program = [sys.executable, "-m", "tests.benchmarks.main_job"]
    for out in ("first", "second"):
        done = subprocess.run([*program, tmp_path / out], capture_output=True, text=True, check=True, cwd=ROOT)
    found = json.loads(done.stdout.splitlines()[-1])
    benchmark.pedantic(lambda: None)
    total, parts = found["total_s"], found["parts_s"]
    assert 0.0 < found["filter_share_of_runs"] < 1.0
    in_runs = next(seconds for part, seconds in parts.items() if part.startswith("runs"))
    board.shares = [Share(part, seconds, seconds / total) for part, seconds in parts.items()]
    steps = in_runs * found["filter_share_of_runs"]
    board.shares.append(Share("of the runs: filter steps", steps, steps / total))
    board.shares.append(Share("in all", total, 1.0))
