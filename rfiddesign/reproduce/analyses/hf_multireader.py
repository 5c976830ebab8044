"""hf_multireader_mcl: how close table 2 comes, what reinitialization is worth, where the combination model wins."""

import numpy as np
from matplotlib.figure import Figure

from rfiddesign.evaluate import ratio_of_means
from rfiddesign.report.figures.style import CYCLE, MARKERS, new_figure, styled
from rfiddesign.reproduce.context import Context
from rfiddesign.reproduce.rows import Row, row_of

# Likelihood sigmas tried, over the radius of the detection area, and the rows tried with them.
SIGMAS = (0.5, 0.6, 0.7, 0.85, 1.0, 1.1, 1.25, 1.5, 1.75, 2.0, 2.5, 3.3)
SYSTEMS = {"96 readers, 100 tags/m2": "table 2", "8 readers, 100 tags/m2": "table 4"}
N_RUNS, N_QUICK_RUNS = 40, 2
BOTH = ("x_mm", "y_mm")


def analyse(context: Context) -> tuple[list[Row], dict[str, Figure]]:
    """Rows and figures beside the tables."""
    rows = [_distance_to_table_2(context), *_worth_of_reinitialization(context)]
    curves = {}
    for system, table in SYSTEMS.items():
        curves[system] = _by_sigma(context, system, table)
        rows += _winning_range(system, curves[system])
    return rows, {"likelihood-sigma": sigma_figure(curves)}


def _distance_to_table_2(context: Context) -> Row:
    """Root mean square of ln(measured / published) over the x and y means of table 2."""
    logs = [
        np.log(row.measured / row.published)
        for row in context.rows
        if row.table == "table 2" and row.metric in BOTH and row.published is not None
    ]
    distance = float(np.sqrt(np.mean(np.square(logs))))
    return Row("table 2", "all", "rms_ln_ratio", None, distance, None, "1")


def _worth_of_reinitialization(context: Context) -> list[Row]:
    """How many times larger the errors of table 3 are than those of the same start with reinitialization."""
    rows = []
    for kind in ("Gaussian", "Combination"):
        without, with_it = (context.errors["table 3", f"100 {kind}{more}"] for more in ("", ", reinitialized"))
        for metric in BOTH:
            ratio = float(without[metric].mean() / with_it[metric].mean())
            rows.append(Row("table 3", f"100 {kind}", f"{metric}_over_reinitialized", None, ratio, None, "1"))
    return rows


def _by_sigma(context: Context, system: str, table: str) -> np.ndarray:
    """(n_sigmas, 3): sigma over radius; ratio of the mean errors, combination over Gaussian; its standard error."""
    n_runs, points = N_QUICK_RUNS if context.is_quick else N_RUNS, []
    for sigma in SIGMAS:
        gaussian, combination = (
            context.measure(
                context.case(table, f"100 {kind}", mcl__sigma_per_radius=sigma), n_runs,
                f"{system}, {kind}, sigma {sigma:g} radii",
            )["position_mm"]
            for kind in ("Gaussian", "Combination")
        )  # fmt: skip
        ratio = ratio_of_means(combination, gaussian)
        points.append((sigma, ratio.mean, ratio.stderr))
    return np.array(points)


def _winning_range(system: str, curve: np.ndarray) -> list[Row]:
    """Between which sigmas the combination model has the smaller error, by interpolation of the ratios."""
    sigmas, ratios = curve[:, 0], curve[:, 1]
    best = int(np.argmin(ratios))
    low = high = float(sigmas[best])
    for k in range(best, 0, -1):
        low = float(sigmas[k - 1])
        if ratios[k - 1] >= 1:
            low = float(np.interp(1.0, ratios[[k, k - 1]], sigmas[[k, k - 1]]))
            break
    for k in range(best, len(sigmas) - 1):
        high = float(sigmas[k + 1])
        if ratios[k + 1] >= 1:
            high = float(np.interp(1.0, ratios[[k, k + 1]], sigmas[[k, k + 1]]))
            break
    found = {"wins_from_sigma_per_radius": low, "wins_to_sigma_per_radius": high}
    found |= {"best_sigma_per_radius": float(sigmas[best]), "best_ratio": float(ratios[best])}
    if ratios[best] >= 1:
        found = {"best_sigma_per_radius": float(sigmas[best]), "best_ratio": float(ratios[best])}
    return [row_of("figure sigma", system, metric, np.array([value])) for metric, value in found.items()]


@styled
def sigma_figure(curves: dict[str, np.ndarray]) -> Figure:
    """Ratio of the errors of both models over the likelihood's sigma; below 1 the combination model wins."""
    figure = new_figure(3.2)
    axes = figure.subplots()
    for (system, curve), colour, marker in zip(curves.items(), CYCLE, MARKERS, strict=False):
        axes.errorbar(
            curve[:, 0], curve[:, 1], 2 * curve[:, 2], color=colour, marker=marker, markersize=4, capsize=2,
            label=system.replace("/m2", "/m²"),
        )  # fmt: skip
    axes.axhline(1.0, color="black", linewidth=0.8)
    axes.text(axes.get_xlim()[1], 0.98, "below: combination wins ", ha="right", va="top", fontsize=8)
    axes.set(xlabel="likelihood sigma / radius of the detection area", ylabel="error, combination / Gaussian")
    axes.set_ylim(bottom=0)
    axes.legend(title="bars: 2 standard errors", loc="upper left")
    return figure
