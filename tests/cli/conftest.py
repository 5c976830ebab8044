"""The command line called in this process: quick, and its signal handlers taken back."""

import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest


@dataclass(frozen=True)
class Answer:
    """How a command ended and what it printed."""

    status: int
    out: str
    err: str


@pytest.fixture
def cli(capsys: pytest.CaptureFixture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable]:
    """Call `rfiddesign` with arguments, in an empty folder."""
    from rfiddesign.cli import main

    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    # On a slow machine, or one where kernels are yet to be compiled, progress would stand before what is asked for.
    for patience in ("PLAIN_INTERVAL_S", "PATIENCE_S"):
        monkeypatch.setattr(f"rfiddesign.cli.progress.{patience}", 1e6)
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def call(*arguments: object) -> Answer:
        capsys.readouterr()
        status = 0
        try:
            main([str(argument) for argument in arguments])
        except SystemExit as end:
            status = end.code or 0
        return Answer(status, *capsys.readouterr())

    yield call
    for number, handler in handlers.items():
        signal.signal(number, handler)
