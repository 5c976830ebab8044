"""Figures of a reproduction of snapshots: the places, figure 3 of the paper, the start, and a drive."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rfiddesign.models.reads_over_floor import reads_over_floor
from rfiddesign.numerics._noise_kernels import run_key
from rfiddesign.report.figures.scene import scene_figure
from rfiddesign.report.figures.style import BLUE, CYCLE, GREY, VERMILLION, new_figure, styled
from rfiddesign.reproduce.reproduction import Reproduction
from rfiddesign.reproduce.snapshots.data import HIGHER, LAB, data_set
from rfiddesign.reproduce.snapshots.experiments import CYCLES, FEW_CYCLES, K_PRIMES, STARTS, STEPS, Errors, K, k_name
from rfiddesign.simulation.snapshot_run import SnapshotTrace, localize, train

# The drive that is drawn: of world 1, with as many cycles.
_DRAWN_CYCLES = 2
_READS_CELL_MM = 100.0
# Marks of an axis of errors [m].
_ERRORS_M = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0)


def figures_of(loaded: Reproduction, errors: Errors) -> dict[str, Figure]:
    """All figures by name."""
    file, found = loaded.file, {}
    mountings = file.drive.settings().mountings
    for name, place in (("laboratory", LAB), ("corridor", HIGHER)):
        data = data_set(file, place, 1, _DRAWN_CYCLES)
        reads = reads_over_floor(data.field(0), data.scene.floor, mountings, 0.0, _DRAWN_CYCLES, _READS_CELL_MM)
        words = f"tags expected per snapshot (N = {_DRAWN_CYCLES}, heading along x)"
        found[name] = scene_figure(data.scene, data.logs[0].true_poses[:, :2], reads, words)
        if place == LAB:
            trained = train(
                list(data.logs[:2]), data.scene.floor.navigable, np.array(mountings), file.smoothing.smoothing(),
                file.filter.grid(),
            )  # fmt: skip
            trace = localize(
                trained, file.filter.settings(K), data.logs[2], run_key(np.uint64(file.seed), np.uint64(0))
            )
            found["drive"] = drive_figure(trace)
    found["table-iv"] = k_prime_figure(errors)
    found["table-ii"] = start_figure(errors)
    return found


@styled
def k_prime_figure(errors: Errors) -> Figure:
    """Mean errors of runs in the laboratory by cycles and k', as boxes (figure 3a)."""
    figure = new_figure(3.4)
    axes = figure.subplots()
    width = 0.8 / len(K_PRIMES)
    for j, k_prime in enumerate(K_PRIMES):
        values = [errors["table IV", f"{n} {k_name(k_prime)}"] for n in CYCLES]
        places = np.arange(len(CYCLES)) + (j - (len(K_PRIMES) - 1) / 2) * width
        boxes = axes.boxplot(
            values, positions=places, widths=0.85 * width, patch_artist=True, flierprops={"markersize": 2.5},
            medianprops={"color": "black"}, manage_ticks=False,
        )  # fmt: skip
        for box in boxes["boxes"]:
            box.set_facecolor(CYCLE[j])
        boxes["boxes"][0].set_label(f"k' = {k_name(k_prime)}")
    axes.set_xticks(range(len(CYCLES)), [str(n) for n in CYCLES])
    axes.set_xlabel("cycles N of a snapshot")
    axes.set_ylabel("mean error of a run [m]")
    # A robot that was lost is metres off: on a linear axis it would hide all the others.
    axes.set_yscale("log")
    axes.set_yticks(_ERRORS_M, [f"{error:g}" for error in _ERRORS_M])
    axes.minorticks_off()
    axes.legend(ncols=len(K_PRIMES), loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


@styled
def start_figure(errors: Errors) -> Figure:
    """Distribution of the errors after 1 and 10 steps by the way to begin (table II)."""
    figure = new_figure(3.4)
    for axes, n in zip(figure.subplots(1, len(FEW_CYCLES), sharey=True), FEW_CYCLES, strict=True):
        for j, name in enumerate(STARTS):
            for step, style in zip(STEPS, ("-", "--"), strict=True):
                values = np.sort(errors[f"table II, step {step}", f"{name} {n}"])
                shares = np.arange(1, values.size + 1) / values.size
                axes.step(values, shares, style, c=CYCLE[j], where="post")
        axes.set_title(f"N = {n}")
        axes.set_xlabel("error [m]")
        axes.set_xlim(0, 2.5)
        axes.set_ylim(0, 1)
    figure.axes[0].set_ylabel("share of starts")
    lines = [Line2D([], [], color=CYCLE[j], label=name) for j, name in enumerate(STARTS)]
    lines += [
        Line2D([], [], color=GREY, linestyle=style, label=f"after step {step}")
        for step, style in zip(STEPS, ("-", "--"), strict=True)
    ]
    figure.legend(handles=lines, loc="outside upper center", ncols=2)
    return figure


@styled
def drive_figure(trace: SnapshotTrace) -> Figure:
    """A drive, what the filter made of it, and the error over time."""
    figure = new_figure(5.6)
    plan, curve = figure.subplots(2, 1, height_ratios=(2.2, 1))
    plan.plot(*trace.true_poses[:, :2].T / 1e3, c=GREY, lw=1.2, label="truth")
    plan.plot(*trace.poses[:, :2].T / 1e3, c=VERMILLION, lw=0.7, label="estimate")
    plan.set_aspect("equal", adjustable="datalim")
    plan.set_xlabel("x [m]")
    plan.set_ylabel("y [m]")
    plan.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    curve.plot(trace.time_s, trace.position_error_mm / 1e3, c=BLUE, lw=0.8)
    curve.set_xlabel("time [s]")
    curve.set_ylabel("error [m]")
    curve.set_ylim(0)
    return figure
