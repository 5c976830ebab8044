"""All figures of a report: which there are, what they are called and what they show."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from rfiddesign.report.contents import Answer, Contents
from rfiddesign.report.figures import (
    CostErrorLabels,
    TestedDesigns,
    cost_error_figure,
    cost_split_figure,
    coverage_figure,
    drives_figure,
    error_curves_figure,
    fronts_figure,
    layout_figure,
    tags_figure,
)
from rfiddesign.report.figures.place import place_on_route, standing_place
from rfiddesign.report.words import count, in_unit, limit_of, plotted_metric


@dataclass(frozen=True)
class Picture:
    """A figure in a report.

    Parameters
    ----------
    topic : what it is about: the section of the page it belongs to.
    name : name of its files.
    caption : what it shows, in a line.
    figure : the figure.
    """

    topic: str
    name: str
    caption: str
    figure: Figure


def pictures(contents: Contents) -> Iterator[Picture]:
    """Draw every figure of a report, one at a time."""
    result = contents.result
    if any(answer.record.winner is not None for answer in contents.answers):
        figure = cost_split_figure(list(result.answers))
        yield Picture("cost-split", "cost-split", "What the price of each fleet is made of.", figure)
    yield Picture("fronts", "cost-against-limit", "Cheapest price at each limit.", fronts_figure(result))
    for answer in contents.answers:
        whose = f"{count(answer.record.n_robots, 'robot')}: "
        yield Picture(
            "cost-error",
            f"cost-against-error-{answer.key}",
            f"{whose}every design tested.",
            _cost_error(contents, answer),
        )
        if answer.chosen is not None:
            yield from _design_pictures(contents, answer, whose)


def _design_pictures(contents: Contents, answer: Answer, whose: str) -> Iterator[Picture]:
    chosen, tags = answer.chosen, answer.tags_mm
    place = standing_place(contents.plan.navigable)
    if contents.routes is not None:
        place = place_on_route(contents.routes.network)
    figure = layout_figure(chosen, tags - np.array(place))
    yield Picture("layout", f"layout-{answer.key}", f"{whose}{chosen.layout}, seen from above.", figure)
    figure = tags_figure(contents.plan.drivable, tags, chosen, place)
    yield Picture(
        "tags", f"tags-{answer.key}", f"{whose}{chosen.pattern} pattern, {chosen.tags_per_m2:g} tags per m².", figure
    )
    coverage = answer.record.coverage
    if coverage is not None:
        figure = coverage_figure(chosen, coverage, tags, place)
        yield Picture(
            "coverage", f"coverage-{answer.key}", f"{whose}readers that see a tag, by the robot's place.", figure
        )
        if coverage.drives:
            yield Picture(
                "drives",
                f"blind-distance-{answer.key}",
                f"{whose}distance driven without a read.",
                drives_figure(coverage),
            )
    if answer.traces:
        figure = error_curves_figure(answer.traces, contents.result.requirement)
        yield Picture(
            "errors", f"error-curves-{answer.key}", f"{whose}errors of {count(len(answer.traces), 'drive')}.", figure
        )


def _cost_error(contents: Contents, answer: Answer) -> Figure:
    record, requirement = answer.record, contents.result.requirement
    metric = plotted_metric(requirement)
    measured = [(d, contents.design(d)) for d in record.decisions]
    measured = [(decision, design) for decision, design in measured if metric in design.metrics and design.n_runs > 0]
    designs = TestedDesigns(
        cost=np.array([decision.cost_cents / 100 for decision, _ in measured]),
        error=np.array([in_unit(metric, design.metrics[metric].mean)[0] for _, design in measured]),
        verdict=np.array([decision.verdict for decision, _ in measured], dtype=str),
        complete_share=np.array([design.n_complete / design.n_runs for _, design in measured]),
    )
    limit = limit_of(requirement, metric)
    winner, winner_name = None, ""
    if record.winner is not None:
        design = contents.design(record.winner)
        winner_name = f"{design.layout}, {design.antenna} mm,\n{design.pattern}, {design.tags_per_m2:g} tags/m²"
        if contents.chosen_estimator(record.winner) is not None:
            winner_name += f",\n{design.estimator}"
        if metric in design.metrics:
            winner = (record.winner.cost_cents / 100, in_unit(metric, design.metrics[metric].mean)[0])
    labels = CostErrorLabels(
        currency=record.currency,
        metric=metric,
        unit=in_unit(metric, 1.0)[1],
        limit=None if limit is None else in_unit(metric, limit)[0],
        winner=winner,
        winner_name=winner_name,
    )
    return cost_error_figure(designs, labels)
