"""Cost against error of two families of designs: tags in the floor, tags on shelves."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from rfiddesign.report.figures.scales import set_scale
from rfiddesign.report.figures.style import BLUE, FLOOR, GREY, ORANGE, new_figure, no_data, plain_map, styled
from rfiddesign.report.words import in_unit, metric_name
from rfiddesign.results.shelves import Shelves
from rfiddesign.units import CENTS_PER_UNIT

#: Family: name, colour, marker.
LOOKS = {"floor": ("tags in the floor", BLUE, "o"), "shelves": ("tags on shelves", ORANGE, "s")}
#: A tested design is drawn if at least this share of its runs was driven to the end: else its error is a lower bound.
COMPLETE_SHARE = 0.9
_SHELF = "#4b5563"


@styled
def families_figure(shelves: Shelves, n_robots: int) -> Figure:
    """Draw what each family costs at each limit, certified, over the designs that were tested, for one fleet."""
    figure = new_figure(4.2)
    place = shelves.robots.index(n_robots)
    costs, errors = [], []
    axes = figure.subplots()
    for family, (name, colour, marker) in LOOKS.items():
        tested = [
            (each.costs_cents[place] / CENTS_PER_UNIT, in_unit(shelves.metric, each.error.mean)[0])
            for each in shelves.tested
            if each.family == family and each.n_complete >= COMPLETE_SHARE * each.n_runs
        ]
        if tested:
            x, y = np.array(tested).T
            axes.scatter(x, y, s=9, marker=marker, c=colour, alpha=0.4, linewidths=0, label=f"{name}: error of drives")
            costs, errors = costs + x.tolist(), errors + y.tolist()
        certified = _certified(shelves, family, n_robots)
        if certified:
            x, y = np.array(certified).T
            axes.step(x, y, where="post", c=colour, lw=1.4, zorder=3)
            axes.scatter(x, y, s=40, marker=marker, c=colour, edgecolors="white", linewidths=0.6, zorder=4,
                         label=f"{name}: certified at this limit")  # fmt: skip
            costs, errors = costs + x.tolist(), errors + y.tolist()
    if not costs:
        return no_data(new_figure(2.0), "No design of either family was certified or driven to the end.")
    set_scale(axes.xaxis, min(costs), max(costs), is_money=True)
    set_scale(axes.yaxis, max(min(errors), 1e-3), max(errors))
    axes.set_xlabel(f"cost [{shelves.currency}]")
    axes.set_ylabel(
        f"{metric_name(shelves.metric)}\nlimit, or mean over drives [{in_unit(shelves.metric, 1.0)[1].strip()}]"
    )
    figure.legend(loc="outside lower left", ncols=1, handletextpad=0.4, borderaxespad=0.2)
    return figure


@styled
def hall_figure(shelves: Shelves) -> Figure:
    """Draw the hall with its rows of shelves."""
    hall = shelves.hall
    figure = new_figure(float(np.clip(3.5 * hall.width_mm / hall.length_mm, 1.0, 4.5)) + 0.7)
    axes = figure.subplots()
    plain_map(axes)
    axes.add_patch(Rectangle((0, 0), hall.length_mm / 1e3, hall.width_mm / 1e3, fc=FLOOR, ec=GREY, lw=0.8))
    for low_x, low_y, high_x, high_y in hall.rows_mm:
        _box(axes, low_x, low_y, high_x, high_y)
    axes.autoscale_view()
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    return figure


def _box(axes: Axes, low_x: float, low_y: float, high_x: float, high_y: float) -> None:
    width, height = (high_x - low_x) / 1e3, (high_y - low_y) / 1e3
    axes.add_patch(Rectangle((low_x / 1e3, low_y / 1e3), width, height, fc=_SHELF, ec=GREY, lw=0.5))


def _certified(shelves: Shelves, family: str, n_robots: int) -> list[tuple[float, float]]:
    """(cost, limit) of a family's winners for a fleet, by rising cost and falling limit."""
    found = []
    for factor in shelves.factors:
        answer = shelves.answer(family, n_robots, factor)
        if answer.cost_cents is not None:
            found.append((answer.cost_cents / CENTS_PER_UNIT, in_unit(shelves.metric, answer.limits[0].limit)[0]))
    return sorted(found, key=lambda each: (each[0], -each[1]))
