"""One board for all benchmarks, printed at the end and, if asked for, saved with a chart."""

import os
from pathlib import Path

import pytest

from tests.benchmarks.board import Board
from tests.benchmarks.document import save

# Before numpy is first loaded: every contender has one thread.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

_BOARD = pytest.StashKey[Board]()


def pytest_addoption(parser):
    parser.addoption("--save-table", metavar="DIR", help="write the table and its chart to this folder")


def pytest_configure(config):
    config.stash[_BOARD] = Board()


@pytest.fixture
def board(request):
    """Where a benchmark puts its row."""
    return request.config.stash[_BOARD]


def pytest_terminal_summary(terminalreporter, config):
    board = config.stash[_BOARD]
    if not board.rows and not board.curves and not board.shares:
        return
    terminalreporter.section("rfiddesign against others, one interleaved run, minimum of many")
    for text in (board.table(), board.growth(), board.profile()):
        terminalreporter.write_line(text)
        terminalreporter.write_line("")
    folder = config.getoption("--save-table")
    if folder:
        save(board, Path(folder))
