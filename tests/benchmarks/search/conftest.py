"""The table of all searches, printed at the end and, if asked for, saved as a page."""

import datetime
from pathlib import Path

import pytest

from tests.benchmarks.search.document import page
from tests.benchmarks.search.scores import Score, table

_SCORES = pytest.StashKey[list[Score]]()


@pytest.fixture(scope="session")
def rows(request):
    """Where a comparison puts its rows."""
    return request.config.stash.setdefault(_SCORES, [])


def pytest_terminal_summary(terminalreporter, config):
    rows = config.stash.get(_SCORES, [])
    if not rows:
        return
    terminalreporter.section("certified search against others")
    terminalreporter.write_line(table(rows))
    folder = config.getoption("--save-table")
    if folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        (Path(folder) / "search.md").write_text(page(rows, datetime.date.today()), encoding="utf-8")
