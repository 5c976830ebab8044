"""The report of a study, drawn from its result folder alone."""

from rfiddesign.report.comparison import write_comparison
from rfiddesign.report.page import write_report
from rfiddesign.report.placements import draw_placements
from rfiddesign.results.spreadsheet import write_cost_csv

__all__ = ["draw_placements", "write_comparison", "write_cost_csv", "write_report"]
