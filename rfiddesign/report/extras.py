"""Sections of the page that only some studies have, each drawn from a file of its own in the result folder."""

from collections.abc import Callable

from rfiddesign.report.contents import Contents
from rfiddesign.report.exploration import exploration_extra, pareto_extra
from rfiddesign.report.extra import Extra
from rfiddesign.report.placements import placements_extra
from rfiddesign.report.regimes import regimes_section
from rfiddesign.report.routes import routes_extra
from rfiddesign.report.shelves import shelves_section
from rfiddesign.report.survey import survey_extra

#: What looks for each section in a result folder, in the order of the page; None where a study has no such thing.
READERS: tuple[Callable[[Contents], Extra | None], ...] = (
    regimes_section, shelves_section, routes_extra, survey_extra, placements_extra, pareto_extra, exploration_extra,
)  # fmt: skip


def extras(contents: Contents) -> tuple[Extra, ...]:
    """The sections that a result folder has beside those that all have."""
    return tuple(extra for read in READERS if (extra := read(contents)) is not None)
