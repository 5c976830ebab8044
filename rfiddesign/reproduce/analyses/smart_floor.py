"""markov_kalman_smart_floor: shares of seeds, the chance of a read along a path, and eqs. 3 and 4 by simulation."""

import math
from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

from rfiddesign.floor import build_tag_map
from rfiddesign.geometry import TagPattern, make_pattern
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.report.figures.style import CYCLE, LINE_STYLES, MARKERS, new_figure, styled
from rfiddesign.reproduce.context import Context
from rfiddesign.reproduce.rows import Row, row_of
from rfiddesign.simulation.record import record
from rfiddesign.simulation.run import Trace, key_of
from rfiddesign.simulation.scenario import World

TABLE = "figure 5"
ROWS = ("odometry", "X-Y", "X-Y-theta")
PITCH_MM, RADIUS_MM = 500.0, 100.0
PATHS_MM = (250.0, 500.0, 1000.0, 2000.0)
N_PATHS, N_QUICK_PATHS = 200_000, 20_000
# Way between two polls of the paths of eqs. 3 and 4.
POLL_MM = 1.0


def analyse(context: Context) -> tuple[list[Row], dict[str, Figure]]:
    """Rows and figures beside figure 5."""
    errors = {name: context.errors[TABLE, name]["position_mm"] for name in ROWS}
    rows = [
        row_of(TABLE, f"{better} below {worse}", "share_of_seeds", errors[better] < errors[worse])
        for worse, better in pairwise(ROWS)
    ]
    n_paths = N_QUICK_PATHS if context.is_quick else N_PATHS
    rng = np.random.Generator(np.random.PCG64(context.loaded.file.seed))
    curves = {}
    for name, pattern in patterns().items():
        curves[name] = read_chances(pattern, n_paths, rng)
        for length, chance in zip(PATHS_MM, curves[name], strict=True):
            spread = math.sqrt(chance * (1 - chance) / n_paths)
            rows.append(Row("chance of a read", f"{name}, {length:g} mm", "chance", None, chance, spread, "1"))
    rows += bounds_of_equations_3_and_4(context)
    return rows, {"figure-5": errors_figure(context.traces(TABLE, ROWS)), "chance-of-a-read": chance_figure(curves)}


def patterns() -> dict[str, TagPattern]:
    """The square pattern, and the triangular one as wide and as dense."""
    square = make_pattern("square", pitch_mm=PITCH_MM)
    return {
        "square": square,
        "triangular, equal spacing": make_pattern("triangular", pitch_mm=PITCH_MM),
        "triangular, equal density": make_pattern("triangular", tags_per_m2=square.tags_per_m2),
    }


def read_chances(pattern: TagPattern, n_paths: int, rng: np.random.Generator) -> list[float]:
    """Chance that a straight path, placed and turned at random, comes within the antenna's radius of a tag.

    For each length of `PATHS_MM`.  A path of one length is the beginning of that of the next.
    """
    lattice = pattern.lattice
    starts = lattice.at(rng.random((n_paths, 2)))
    angles = rng.random(n_paths) * 2 * math.pi
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    # Tags about the cell of the starts, as far as the longest path goes.
    n = math.ceil((PATHS_MM[-1] + RADIUS_MM) / (lattice.min_distance_mm * math.sqrt(3) / 2)) + 1
    tags = lattice.at(np.stack(np.meshgrid(np.arange(-n, n + 2), np.arange(-n, n + 2)), axis=-1).reshape(-1, 2))
    tree, first = cKDTree(tags), np.full(n_paths, math.inf)
    # Along each path, the tags near successive midpoints: where the path first enters a disc about one.
    part = 250.0
    for begin in np.arange(0.0, PATHS_MM[-1], part):
        middles = starts + ways * (begin + part / 2)
        near = tree.query_ball_point(middles, part / 2 + RADIUS_MM)
        counts = np.fromiter(map(len, near), int, n_paths)
        path = np.repeat(np.arange(n_paths), counts)
        to_tag = tags[np.concatenate([np.asarray(found, int) for found in near])] - starts[path]
        along = (to_tag * ways[path]).sum(axis=1)
        across = to_tag[:, 0] * ways[path, 1] - to_tag[:, 1] * ways[path, 0]
        half_chord = np.sqrt(np.maximum(RADIUS_MM**2 - across**2, 0.0))
        is_met = (np.abs(across) < RADIUS_MM) & (along + half_chord > 0)
        np.minimum.at(first, path[is_met], np.maximum(along - half_chord, 0.0)[is_met])
    return [float((first <= length).mean()) for length in PATHS_MM]


def bounds_of_equations_3_and_4(context: Context) -> list[Row]:
    """Robots drive beside a row of tags: where the first read finds the tag, along the way and across it.

    Eq. 3: the tag is ahead, at most a radius; eq. 4: across the way it is off by at most sqrt(R^2 - ahead^2).
    """
    case = context.case(TABLE, "X-Y")
    seed, n_runs = context.loaded.file.seed, 200 if context.is_quick else 2000
    rng = np.random.Generator(np.random.PCG64(seed))
    tags = build_tag_map(make_pattern("square", pitch_mm=PITCH_MM).lay(case.scenario.floor.drivable))
    still = World(motion=OmnidirectionalMotion(0.0, 0.0, 0.0))
    ahead, across = [], []
    for run in range(n_runs):
        offset = rng.uniform(-RADIUS_MM, RADIUS_MM)
        x = 1000.0 - 150.0 - rng.random() + np.arange(251) * POLL_MM
        poses = np.column_stack([x, np.full(x.size, 1000.0 + offset), np.zeros(x.size)])
        recording = record(case.design, tags, poses, 0.01, still, key_of(seed, run))
        if recording.n_reads:
            step = int(np.searchsorted(recording.read_start, 1)) - 1
            dx, dy = recording.read_tag_mm[0] - recording.true_poses[step + 1, :2]
            ahead.append(dx)
            across.append(dy)
    ahead, across = np.array(ahead), np.array(across)
    bound = np.sqrt(np.maximum(RADIUS_MM**2 - ahead**2, 0.0))
    keeps_3 = (ahead >= -POLL_MM) & (ahead <= RADIUS_MM)
    return [
        row_of("eqs. 3 and 4", "first read within eq. 3", "share", keeps_3),
        row_of("eqs. 3 and 4", "first read within eq. 4", "share", np.abs(across) <= bound + 1e-6),
        row_of("eqs. 3 and 4", "ahead, largest", "mm", np.array([ahead.max()])),
        row_of("eqs. 3 and 4", "ahead, mean over radius", "ratio", ahead / RADIUS_MM),
        row_of("eqs. 3 and 4", "across over its bound, largest", "ratio", np.array([(np.abs(across) / bound).max()])),
    ]


@styled
def errors_figure(traces: dict[str, Trace]) -> Figure:
    """Position error of run 0 over time."""
    figure = new_figure(2.8)
    axes = figure.subplots()
    for (name, trace), colour, line in zip(traces.items(), CYCLE, LINE_STYLES, strict=False):
        times = (np.arange(trace.position_error_mm.size) + 1) * trace.dt_s
        axes.plot(times, trace.position_error_mm, color=colour, linestyle=line, label=name)
    axes.set(xlabel="time [s]", ylabel="position error [mm]", ylim=(0, None))
    axes.legend(loc="upper left")
    return figure


@styled
def chance_figure(curves: dict[str, list[float]]) -> Figure:
    """Chance of at least one read over the length of a straight path."""
    figure = new_figure(2.8)
    axes = figure.subplots()
    lengths = np.array(PATHS_MM) / 1e3
    for (name, chances), colour, line, marker in zip(curves.items(), CYCLE, LINE_STYLES, MARKERS, strict=False):
        axes.plot(lengths, chances, color=colour, linestyle=line, marker=marker, markersize=5, label=name, alpha=0.85)
    axes.set(xlabel="length of the path [m]", ylabel="chance of a read", ylim=(0, 1.02), xlim=(0, None))
    axes.set_xticks([0.0, *lengths], [f"{length:g}" for length in (0.0, *lengths)])
    axes.legend(loc="lower right")
    return figure
