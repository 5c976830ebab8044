"""Expected reads over a floor are those of the antennas at each place."""

import math

import numpy as np
import pytest

from rfiddesign.floor.scenes import laboratory
from rfiddesign.geometry import compose
from rfiddesign.models import reads_over_floor as module
from rfiddesign.models.reads_over_floor import reads_over_floor
from rfiddesign.models.uhf import PAIRS_OF_B21, UhfWorld

LAB = laboratory()
WORLD = UhfWorld(LAB, seed=4)


def test_expected_tags_are_those_that_at_least_one_cycle_reads(monkeypatch):
    x, y, reads = reads_over_floor(WORLD, LAB.floor, PAIRS_OF_B21, 0.7, 3, 500.0)
    assert reads.shape == (len(y), len(x))
    n_checked = 0
    for j, i in np.argwhere(np.isfinite(reads))[::7]:
        missed = 1.0
        for mounting in PAIRS_OF_B21:
            chance = WORLD.read_probability(compose([x[i], y[j], 0.7], mounting)[None])[0].astype(float)
            missed = missed * (1 - chance) ** 3
        assert reads[j, i] == pytest.approx((1 - missed).sum(), rel=1e-4)
        n_checked += 1
    assert n_checked > 10
    area_m2 = np.isfinite(reads).sum() * 0.25
    assert area_m2 == pytest.approx(LAB.floor.navigable_m2, rel=0.1)
    # In portions the same.
    monkeypatch.setattr(module, "_MAX_CHANCES", 2_000)
    assert np.array_equal(reads_over_floor(WORLD, LAB.floor, PAIRS_OF_B21, 0.7, 3, 500.0)[2], reads, equal_nan=True)


def test_too_many_cells_are_refused():
    with pytest.raises(ValueError, match="cell_mm is 0"):
        reads_over_floor(WORLD, LAB.floor, PAIRS_OF_B21, 0.0, 1, 0.1)
    with pytest.raises(ValueError, match="cell_mm"):
        reads_over_floor(WORLD, LAB.floor, PAIRS_OF_B21, 0.0, 1, math.nan)
