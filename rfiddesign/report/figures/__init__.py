"""Figures of a report: functions from records and arrays to matplotlib figures."""

from rfiddesign.report.figures.comparison import comparison_figure
from rfiddesign.report.figures.cost_error import CostErrorLabels, TestedDesigns, cost_error_figure
from rfiddesign.report.figures.cost_split import cost_split_figure
from rfiddesign.report.figures.coverage import coverage_figure
from rfiddesign.report.figures.drives import drives_figure
from rfiddesign.report.figures.error_curves import error_curves_figure
from rfiddesign.report.figures.fronts import fronts_figure
from rfiddesign.report.figures.layout import layout_figure
from rfiddesign.report.figures.routes import routes_figure
from rfiddesign.report.figures.tags import tags_figure

__all__ = [
    "CostErrorLabels",
    "TestedDesigns",
    "comparison_figure",
    "cost_error_figure",
    "cost_split_figure",
    "coverage_figure",
    "drives_figure",
    "error_curves_figure",
    "fronts_figure",
    "layout_figure",
    "routes_figure",
    "tags_figure",
]
