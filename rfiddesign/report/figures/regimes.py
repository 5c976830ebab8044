"""The map of regimes: which design is cheapest for each fleet and floor, and who carries the price."""

from collections.abc import Callable

import numpy as np
from matplotlib import colormaps, patheffects
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import FixedLocator, NullLocator

from rfiddesign.report.figures.style import BLACK, CYCLE, GREY, WIDTH_IN, new_figure, styled
from rfiddesign.report.words import short_money
from rfiddesign.results.regimes import RegimeCell, RegimeDesign, Regimes

#: Width of the map [in]: that of the page.
MAP_WIDTH_IN = 2.1 * WIDTH_IN
CELL_IN, AROUND_IN, LEGEND_LINE_IN = 0.44, 0.75, 0.2
LEGEND_COLUMNS = 4
HATCHES = ("", "////", "....", "\\\\\\\\", "xxxx", "----", "oooo")
#: How far a family's colour is mixed with white, so that black words can be read on it.
PALENESS = 0.6
#: Words take a lighter colour on shares from here on.
DARK_BELOW = 0.45
HALO = [patheffects.withStroke(linewidth=2.2, foreground="white")]
PATTERN_LETTERS = {"square": "sq", "triangular": "tri", "random": "rnd", "striped": "str", "thinned": "thin"}


@styled
def regimes_figure(regimes: Regimes) -> Figure:
    """Draw the cheapest certified design of each cell: layout and antenna by colour, tags and price in words."""
    families = family_names(regimes)
    n_columns = min(max(len(families), 1), LEGEND_COLUMNS)
    legend_in = LEGEND_LINE_IN * (1 + -(-len(families) // n_columns))
    figure = Figure(figsize=(MAP_WIDTH_IN, CELL_IN * len(regimes.fleets) + AROUND_IN + legend_in), layout="constrained")
    axes = figure.subplots()
    for cell in regimes.cells:
        look = {"facecolor": "white", "hatch": ""}
        if cell.winner is not None:
            look = _look(families.index(_family(regimes.design(cell.winner))))
        axes.add_patch(Rectangle(*_box(regimes, cell), edgecolor="white", linewidth=0.8, **look))
        axes.text(
            cell.area_m2, cell.n_robots, _cell_words(regimes, cell), ha="center", va="center", fontsize=7.5,
            linespacing=1.1, path_effects=HALO,
        )  # fmt: skip
    _draw_boundaries(axes, regimes)
    _set_axes(axes, regimes)
    handles = [Patch(edgecolor=GREY, linewidth=0.6, label=name, **_look(i)) for i, name in enumerate(families)]
    if handles:
        figure.legend(
            handles=handles, loc="outside lower center", ncols=n_columns, columnspacing=1.4, handlelength=2.2,
            handleheight=1.1,
        )  # fmt: skip
    return figure


@styled
def robots_share_figure(regimes: Regimes) -> Figure:
    """Draw which share of each cell's price is spent on robots, in per cent."""

    def share(cell: RegimeCell) -> float:
        return cell.robots_cents / max(cell.cost_cents, 1)

    return _shaded(regimes, share, lambda cell: f"{100 * share(cell):.0f}")


@styled
def price_per_m2_figure(regimes: Regimes) -> Figure:
    """Draw the price of each cell per m2 of its floor."""

    def amount(cell: RegimeCell) -> float:
        return cell.cost_cents / 100 / cell.area_m2

    amounts = [amount(cell) for cell in regimes.cells if cell.winner is not None] or [1.0]
    low, high = np.log(max(min(amounts), 1e-9)), np.log(max(*amounts, 1e-9))

    def shade(cell: RegimeCell) -> float:
        return (np.log(max(amount(cell), 1e-9)) - low) / max(high - low, 1e-9)

    return _shaded(regimes, shade, lambda cell: short_money(amount(cell)))


def family_names(regimes: Regimes) -> list[str]:
    """Layouts with antennas that win anywhere, from the most sparsely used floor to the most densely used."""
    rising = sorted(regimes.cells, key=lambda cell: (cell.robots_per_1000_m2, cell.area_m2))
    return list(dict.fromkeys(_family(regimes.design(cell.winner)) for cell in rising if cell.winner is not None))


def _family(design: RegimeDesign) -> str:
    return f"{design.layout}, {design.antenna} mm"


def _look(i: int) -> dict[str, object]:
    colour = 1.0 - (1.0 - np.array(to_rgb(CYCLE[i % len(CYCLE)]))) * (1.0 - PALENESS)
    return {"facecolor": tuple(colour), "hatch": HATCHES[(i + i // len(HATCHES)) % len(HATCHES)]}


def _cell_words(regimes: Regimes, cell: RegimeCell) -> str:
    """Tags per m2 with the pattern, and the price; what is known of it where nothing is certified."""
    if cell.winner is None:
        if cell.lower_bound_cents is None:
            return "none"
        return f"open\n≥ {short_money(cell.lower_bound_cents / 100)}"
    design = regimes.design(cell.winner)
    pattern = PATTERN_LETTERS.get(design.pattern, design.pattern[:4])
    mark = "*" if cell.n_undecided else ""
    return f"{design.tags_per_m2:g} {pattern}{mark}\n{short_money(cell.cost_cents / 100)}"


def _box(regimes: Regimes, cell: RegimeCell) -> tuple[tuple[float, float], float, float]:
    """Corner, width and height of a cell between the middles (in logarithms) towards its neighbours."""
    left, right = _edges(regimes.areas_m2, cell.area_m2)
    bottom, top = _edges(regimes.fleets, cell.n_robots)
    return (left, bottom), right - left, top - bottom


def _edges(values: list, value: float) -> tuple[float, float]:
    """The middles, in logarithms, between a value and its neighbours; at the ends as far outside as inside."""
    logs = np.log(values)
    middles = (logs[1:] + logs[:-1]) / 2
    edges = np.concatenate([[2 * logs[0] - middles[0]], middles, [2 * logs[-1] - middles[-1]]])
    i = values.index(value)
    return float(np.exp(edges[i])), float(np.exp(edges[i + 1]))


def _draw_boundaries(axes: Axes, regimes: Regimes) -> None:
    """Lines of one ratio of robots to area, on which two neighbouring winners cost the same."""
    low, high = _edges(regimes.areas_m2, regimes.areas_m2[0])[0], _edges(regimes.areas_m2, regimes.areas_m2[-1])[1]
    areas = np.array([low, high])
    for boundary in regimes.boundaries:
        axes.plot(areas, areas * boundary.robots_per_1000_m2 / 1000, color=BLACK, lw=1.1, ls=(0, (5, 2)), zorder=2.5)


def _set_axes(axes: Axes, regimes: Regimes) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(False)
    for axis, values, words in (
        (axes.xaxis, regimes.areas_m2, "tagged floor [m²]"),
        (axes.yaxis, regimes.fleets, "robots of the fleet"),
    ):
        axis.set_major_locator(FixedLocator(values))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(lambda value, _: f"{value:,.6g}")
        axis.set_label_text(words)
    axes.set_xlim(_edges(regimes.areas_m2, regimes.areas_m2[0])[0], _edges(regimes.areas_m2, regimes.areas_m2[-1])[1])
    axes.set_ylim(_edges(regimes.fleets, regimes.fleets[0])[0], _edges(regimes.fleets, regimes.fleets[-1])[1])


def _shaded(
    regimes: Regimes,
    shade: Callable[[RegimeCell], float],
    words: Callable[[RegimeCell], str],
) -> Figure:
    """Cells shaded by a number from 0 to 1, with words on each."""
    figure = new_figure(0.3 * len(regimes.fleets) + 0.75)
    axes = figure.subplots()
    shades = colormaps["cividis"]
    for cell in regimes.cells:
        place = _box(regimes, cell)
        if cell.winner is None:
            axes.add_patch(Rectangle(*place, facecolor="white", edgecolor=GREY, linewidth=0.4, hatch="////"))
            continue
        level = shade(cell)
        axes.add_patch(Rectangle(*place, facecolor=shades(level), edgecolor="white", linewidth=0.6))
        colour = "white" if level < DARK_BELOW else "black"
        axes.text(cell.area_m2, cell.n_robots, words(cell), ha="center", va="center", fontsize=7.5, color=colour)
    _set_axes(axes, regimes)
    axes.tick_params(axis="x", labelrotation=30 if len(regimes.areas_m2) > 6 else 0)
    return figure
