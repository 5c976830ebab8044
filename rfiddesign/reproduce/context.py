"""What an analysis gets to see of a reproduction: what was measured, and the means to simulate more."""

from dataclasses import dataclass
from typing import Any

from rfiddesign.reproduce.cases import Case, case_of
from rfiddesign.reproduce.config import RowSection
from rfiddesign.reproduce.measure import Errors, measure
from rfiddesign.reproduce.progress import OnProgress, counter
from rfiddesign.reproduce.reproduction import Reproduction
from rfiddesign.reproduce.rows import Row
from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.simulation.run import Trace


@dataclass(frozen=True)
class Context:
    """A reproduction whose rows have been measured.

    Parameters
    ----------
    loaded : the reproduction.
    is_quick : whether counts are reduced.
    n_workers : threads.
    rows : what was measured.
    errors : metrics of each run by (table, row).
    on_progress : called with what is under way, how much of it is done and how much there is.
    """

    loaded: Reproduction
    is_quick: bool
    n_workers: int | None
    rows: tuple[Row, ...]
    errors: dict[tuple[str, str], Errors]
    on_progress: OnProgress

    def section(self, table: str, row: str) -> RowSection:
        """The row of the study file of that name."""
        return next(section for section in self.loaded.file.rows if (section.table, section.row) == (table, row))

    def case(self, table: str, row: str, **changes: Any) -> Case:
        """The case of a row with some keys set differently; a dot in a key is written as two underscores."""
        section = self.section(table, row)
        changed = {key.replace("__", "."): value for key, value in changes.items()}
        return case_of(self.loaded, section.model_copy(update={"set": {**section.set, **changed}}))

    def measure(self, case: Case, n_runs: int, what: str) -> Errors:
        """Metrics of each of `n_runs` runs of a case."""
        progress = counter(what, n_runs, self.on_progress)
        return measure(case, n_runs, self.loaded.file.seed, self.n_workers, progress)

    def traces(self, table: str, rows: tuple[str, ...]) -> dict[str, Trace]:
        """Run 0 of some rows of a table, step by step."""
        traces = {}
        for row in rows:
            case = self.case(table, row)
            with Simulator(case.scenario, self.loaded.file.seed, 1) as simulator:
                traces[row] = simulator.trace(Job(case.design, 0))
        return traces
