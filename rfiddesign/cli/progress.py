"""Progress of long work on standard error: a live line on a terminal, now and then a plain line elsewhere."""

import time
from contextlib import ExitStack
from threading import Timer
from typing import Self

from rich.console import Console
from rich.live import Live
from rich.text import Text

# Seconds between two plain lines where there is no terminal to redraw.
PLAIN_INTERVAL_S = 10.0
# Seconds of compilation after which it is told there.
PATIENCE_S = 4.0


class Display:
    """One line that tells what is going on."""

    def __init__(self) -> None:
        self._console = Console(stderr=True)
        self._live = Live(Text(), console=self._console, transient=True, refresh_per_second=8)
        self._begin = self._last = time.monotonic()
        self._text = ""
        self._has_told = False
        self._patience: Timer | None = None
        self._closing = ExitStack()

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live.start()
        self.say("starting")
        from rfiddesign.numerics._compile_kernels import told_of_compilation

        self._closing.enter_context(told_of_compilation(self._tell_of_compilation))
        return self

    def __exit__(self, *exception: object) -> None:
        self._closing.close()
        if self._patience is not None:
            self._patience.cancel()
        if self._console.is_terminal:
            self._live.stop()

    def say(self, text: str) -> None:
        """Show `text` in place of what was shown."""
        self._text = text
        self._show(text, is_due=time.monotonic() - self._last >= PLAIN_INTERVAL_S)

    def _tell_of_compilation(self, kernel: str | None) -> None:
        """Say what is compiled, and why one waits, over what was said; None: nothing is any more.

        Where there is no terminal, only once and only if one really waits: a fault in the input is one line.
        """
        if self._patience is not None:
            self._patience.cancel()
        if kernel is None:
            self._show(self._text, is_due=False)
            return
        text = f"compiling {kernel}; once after an installation, half a minute in all"
        self._show(text, is_due=False)
        if not self._console.is_terminal and not self._has_told:
            self._patience = Timer(PATIENCE_S, self._tell_once, (text,))
            self._patience.daemon = True
            self._patience.start()

    def _tell_once(self, text: str) -> None:
        self._has_told = True
        self._show(text, is_due=True)

    def _show(self, text: str, is_due: bool) -> None:
        elapsed = time.monotonic() - self._begin
        if self._console.is_terminal:
            self._live.update(Text(f"{elapsed:5.0f} s  {text}"))
        elif is_due:
            self._last = time.monotonic()
            self._console.print(Text(f"{elapsed:5.0f} s  {text}"))


class StageDisplay(Display):
    """Progress of a study."""

    def show(self, stage) -> None:
        """Show a `study.Stage`."""
        if not stage.n_runs:
            self.say(stage.what)
            return
        self.say(
            f"{stage.what}: {stage.n_refuted:,} refuted, {stage.n_racing:,} racing, {stage.n_remaining:,} remaining, "
            f"{stage.n_runs:,} runs looked at"
        )


class CountDisplay(Display):
    """Progress of something that can be counted."""

    def __init__(self, what: str, total: int | None) -> None:
        super().__init__()
        self._what = what
        self._total = total

    def show(self, n_done: int) -> None:
        """Show that `n_done` are done."""
        of_all = "" if self._total is None else f" of {self._total:,}"
        self.say(f"{self._what}: {n_done:,}{of_all}")


class StepDisplay(Display):
    """Progress of several things one after the other, each of which can be counted."""

    def show(self, what: str, n_done: int, total: int) -> None:
        """Show that `n_done` of `total` runs of something are done."""
        self.say(f"{what}: {n_done:,} of {total:,} runs")
