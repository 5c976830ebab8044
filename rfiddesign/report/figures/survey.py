"""How far tags lie from where the plan and a survey have them."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from rfiddesign.report.figures.style import BLUE, GREEN, GREY, VERMILLION, new_figure, plain_map, styled
from rfiddesign.results.survey import SampleTag, SurveyedFloor, SurveyRecord

NOMINAL, SURVEYED, TRUE = GREY, BLUE, VERMILLION
# Colours of the maps that drives were made with.
COLOURS = {"nominal": GREY, "checked": GREEN, "surveyed": BLUE, "true": VERMILLION}
_BINS = 32
# Sigmas of the ellipse that holds 95 % of a Gaussian in the plane.
_ELLIPSE_SIGMAS = 2.45


@styled
def residuals_figure(record: SurveyRecord) -> Figure:
    """Draw the distances of tags from their places on the nominal and on the surveyed map, floor by floor."""
    floors = [floor for floor in record.floors if floor.after is not None]
    figure = new_figure(0.4 + 1.6 * len(floors))
    for axes, floor in zip(figure.subplots(len(floors), 1, squeeze=False)[:, 0], floors, strict=True):
        before, after = np.array(floor.distances_before_mm), np.array(floor.distances_after_mm)
        bins = np.linspace(
            0.0, max(float(np.quantile(before, 0.999)), float(np.quantile(after, 0.999)), 1.0), _BINS + 1
        )
        for distances, name, colour, errors in (
            (before, "nominal", NOMINAL, floor.before),
            (after, "surveyed", SURVEYED, floor.after),
        ):
            words = f"{name} map: root mean square {errors.radial_rms_mm:.1f} mm"
            # The last bin holds what lies beyond.
            axes.hist(np.minimum(distances, bins[-1]), bins, color=colour, alpha=0.55, label=words)
        axes.set_title(f"laid to {floor.installation_error_mm:g} mm per axis", loc="left")
        axes.set_ylabel("tags")
        axes.legend(loc="upper right", fontsize=7.5)
        axes.set_ylim(top=1.45 * axes.get_ylim()[1])
    axes.set_xlabel("distance of a tag from its place on the map [mm]")
    return figure


@styled
def places_figure(floor: SurveyedFloor) -> Figure:
    """Draw some tags about the floor's middle: nominal, true and surveyed places, offsets as if seen through a lens."""
    figure = new_figure(3.9)
    axes = figure.subplots()
    plain_map(axes)
    nominal = np.array([tag.nominal_mm for tag in floor.sample])
    lens = _magnification(floor.sample, nominal)
    for tag in floor.sample:
        _draw_tag(axes, tag, lens)
    surveyed = _at(floor.sample, "surveyed_mm", lens)
    axes.plot(*nominal.T, "+", color=NOMINAL, ms=6, label="nominal")
    if all(tag.true_mm is not None for tag in floor.sample):
        axes.plot(*_at(floor.sample, "true_mm", lens).T, "x", color=TRUE, ms=4.0, mew=1.0, label="true")
    axes.plot(*surveyed.T, "o", color=SURVEYED, ms=2.2, label="surveyed, 95 % ellipse")
    margin = 0.08 * float(np.ptp(nominal, axis=0).max()) + 30.0
    axes.set_xlim(nominal[:, 0].min() - margin, nominal[:, 0].max() + margin)
    axes.set_ylim(nominal[:, 1].min() - margin, nominal[:, 1].max() + margin)
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    drawn = "to scale" if lens == 1.0 else f"drawn {lens:g} times as large"
    axes.set_title(f"laid to {floor.installation_error_mm:g} mm per axis; offsets {drawn}", loc="left")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3, columnspacing=1.0,
                  handletextpad=0.3)  # fmt: skip
    return figure


@styled
def errors_figure(record: SurveyRecord) -> Figure:
    """Draw the mean localization error with each map and on denser floors, by what they cost more."""
    figure = new_figure(0.4 + 1.9 * len(record.floors))
    for axes, floor in zip(figure.subplots(len(record.floors), 1, squeeze=False)[:, 0], record.floors, strict=True):
        survey = record.cost_cents / 100
        for name, cost in (("nominal", 0.0), ("checked", 0.0), ("surveyed", survey), ("true", survey)):
            mean = floor.map(name).position_mean_mm
            axes.errorbar(
                cost, mean.mean, 2 * (mean.stderr or 0.0), fmt="o", color=COLOURS[name], ms=5, label=f"{name} map"
            )
        if floor.denser:
            costs = [0.0, *(denser.extra_cents / 100 for denser in floor.denser)]
            means = [floor.map("checked").position_mean_mm, *(denser.position_mean_mm for denser in floor.denser)]
            axes.errorbar(
                costs, [mean.mean for mean in means], [2 * (mean.stderr or 0.0) for mean in means], fmt="s-", ms=3.0,
                lw=1.0, color=GREEN, alpha=0.7, label="denser floors", zorder=1.5,
            )  # fmt: skip
        axes.axhline(floor.map("surveyed").position_mean_mm.mean, color=BLUE, lw=0.8, ls=":")
        axes.set_ylim(bottom=0.0)
        axes.set_title(f"laid to {floor.installation_error_mm:g} mm per axis", loc="left")
        axes.set_ylabel("mean error [mm]")
    axes.set_xlabel(f"cost beyond the chosen design's [{record.currency}]")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3, columnspacing=1.0,
                  handletextpad=0.3)  # fmt: skip
    return figure


def _draw_tag(axes: Axes, tag: SampleTag, lens: float) -> None:
    nominal = np.array(tag.nominal_mm)
    centre = nominal + lens * (np.array(tag.surveyed_mm) - nominal)
    xx, xy, yy = tag.covariance_mm2
    values, vectors = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
    minor, major = 2.0 * _ELLIPSE_SIGMAS * lens * np.sqrt(np.maximum(values, 0.0))
    angle = math.degrees(math.atan2(vectors[1, 1], vectors[0, 1]))
    axes.add_patch(Ellipse(centre, major, minor, angle=angle, fc="none", ec=SURVEYED, lw=0.7, alpha=0.8))
    axes.plot([nominal[0], centre[0]], [nominal[1], centre[1]], color=NOMINAL, lw=0.6)


def _at(tags: list[SampleTag], name: str, lens: float) -> np.ndarray:
    """Places of tags, their offsets from the nominal ones magnified."""
    nominal = np.array([tag.nominal_mm for tag in tags])
    return nominal + lens * (np.array([getattr(tag, name) for tag in tags]) - nominal)


def _magnification(tags: list[SampleTag], nominal: np.ndarray) -> float:
    """A whole factor that keeps most offsets within a third of the tags' spacing."""
    spacing = math.sqrt(float(np.prod(np.maximum(np.ptp(nominal, axis=0), 1.0))) / max(len(tags), 1))
    offsets = np.hypot(*(np.array([tag.surveyed_mm for tag in tags]) - nominal).T)
    typical = float(np.quantile(offsets, 0.8)) + _ELLIPSE_SIGMAS * math.sqrt(max(tag.covariance_mm2[0] for tag in tags))
    return float(max(1, math.floor(0.4 * spacing / max(typical, 1e-9))))
