"""A reproduction that ends in a second: a robot with one reader drives 0.4 m."""

from collections.abc import Callable
from pathlib import Path

import pytest

STUDY = """
title = "A tiny published system"
source = "nobody: nothing"
seed = 3
runs = 4
quick_runs = 2
[base]
tags_per_m2 = 100.0
floor_m = [3.0, 3.0]
[base.route]
kind = "polyline"
waypoints_mm = [[1000.0, 1000.0], [1400.0, 1000.0]]
speed_mm_per_s = 200.0
heading_deg = 0.0
shift_mm = 100.0
[base.mcl]
n_particles = 50
[[rows]]
table = "table 1"
row = "MCL"
metrics = ["x_mm", "position_mm_var", "theta_rmse_deg"]
[[rows]]
table = "table 1"
row = "odometry"
metrics = ["x_mm", "rmse_mm"]
set = { estimator = "odometry", "route.speed_mm_per_s" = 100.0 }
runs = 3
"""
EXPECTED = """
[published."table 1".MCL]
x_mm = 1.25
[[claims]]
table = "table 1"
row = "MCL"
metric = "x_mm"
at_least = 0.0
at_most = 100.0
[[claims]]
table = "table 1"
row = "MCL"
metric = "y_mm"
at_least = 0.0
"""


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write the tiny reproduction, with `old` replaced by `new` in one of its files."""

    def written(old: str = "", new: str = "", file: str = "study.toml") -> Path:
        folder = tmp_path / "tiny"
        folder.mkdir(exist_ok=True)
        for name, text in (("study.toml", STUDY), ("expected.toml", EXPECTED)):
            if name == file and old:
                assert text.count(old) == 1, f"{old!r} is {text.count(old)} times in {file}"
                text = text.replace(old, new)
            (folder / name).write_text(text)
        return folder

    return written
