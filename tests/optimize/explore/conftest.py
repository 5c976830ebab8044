"""A bench without simulation: margins from a formula and noise that hangs on proposal and run alone."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from shapely.geometry import Point

from rfiddesign.metrics import Requirement, RunMetrics
from rfiddesign.optimize.explore import Choice, Range, Variables, fault_of

LIMIT = Requirement((("position_p95_mm", 10.0),))
FOOTPRINT = Point(0, 0).buffer(320.0)


def run_with(error_mm, convergence_s=1.0):
    return RunMetrics(error_mm, error_mm, error_mm, error_mm, 0.0, 0.0, 0.0, 0.0, convergence_s, 0.0, 100)


@dataclass
class FormulaBench:
    """Errors fall with readers and tags; wider bars see more. Remembers what it was asked."""

    noise: float = 0.1
    n_runs_made: int = 0
    known: dict = field(default_factory=dict)
    interrupted_after: float = np.inf

    def error_mm(self, proposal):
        given = dict(proposal.values)
        density, readers = given["tags_per_m2"], proposal.design.layout.n_readers
        spread = given.get("spacing_mm", 60.0) / 60.0
        return 40.0 / np.sqrt(density * readers / 30.0) / min(spread, 1.5)

    def fault(self, proposal):
        return fault_of(proposal, FOOTPRINT)

    def cost_cents(self, proposal):
        given = dict(proposal.values)
        return round(10_000 * proposal.design.layout.n_readers + 1_000 * given["tags_per_m2"])

    def about_cents(self, proposal):
        return self.cost_cents(proposal)

    def begin(self, proposal, n_runs):
        pass

    def runs(self, proposal, n_runs):
        made = []
        for run in range(n_runs):
            key = (proposal.key, run)
            if key not in self.known:
                self.interrupted_after -= 1
                if self.interrupted_after < 0:
                    raise KeyboardInterrupt
                self.n_runs_made += 1
                generator = np.random.Generator(np.random.PCG64([run]))
                route = generator.normal()
                own = np.random.Generator(np.random.PCG64(list(key))).normal()
                error = self.error_mm(proposal) * float(np.exp(self.noise * (route + own)))
                self.known[key] = run_with(error)
            made.append(self.known[key])
        return made


@pytest.fixture
def variables():
    return Variables(
        (
            Choice("kind", ("bar", "single")),
            Choice("antenna", ("60x60",)),
            Choice("pattern", ("square", "triangular")),
            Range("tags_per_m2", 4.0, 400.0, is_log=True),
            Range("readers", 2, 8),
            Range("spacing_mm", 50.0, 200.0),
        )
    )
