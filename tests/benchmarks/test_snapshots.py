"""Localization by snapshots: the look-up table against direct evaluation, and against the same step in numpy."""

import numpy as np
import pytest

from rfiddesign.estimators.snapshot import build, init, log_likelihood, track
from rfiddesign.estimators.verbs import N_ESTIMATE
from rfiddesign.geometry import compose
from rfiddesign.models.fingerprint_table import tabulate
from rfiddesign.models.snapshots import part_of
from rfiddesign.reproduce import load_reproduction
from rfiddesign.reproduce.snapshots.data import LAB, data_set
from rfiddesign.simulation.snapshot_run import train
from tests.benchmarks.board import Row, race

N_PARTICLES, K_PRIME, N_CYCLES, N_STEPS = 2000, 50, 2, 20
BAR_MS, BAR_MB = 2.0, 200.0


@pytest.mark.parametrize("n_logs", [2, 7])
def test_an_update_from_the_table(benchmark, board, n_logs):
    """2,000 particles and 50 tags for each of two antennas, prediction, estimate and resampling included."""
    file = load_reproduction("uhf-snapshots").file
    data, antennas = data_set(file, LAB, 1, N_CYCLES), np.array(file.drive.settings().mountings)
    trained = train(
        list(data.logs[:n_logs]), data.scene.floor.navigable, antennas, file.smoothing.smoothing(), file.filter.grid()
    )
    drive = part_of(data.logs[-1], 0, N_STEPS + 1)
    settings = file.filter.settings(K_PRIME)
    ready = build(settings, trained.table, antennas, trained.drivable, list(trained.logs), N_CYCLES)
    state, estimates = init(ready, drive, 1), np.empty((N_STEPS + 1, N_ESTIMATE))
    poses = drive.true_poses[0] + np.random.default_rng(0).normal(size=(N_PARTICLES, 3)) * [200.0, 200.0, 0.1]
    at = [compose(poses, mounting) for mounting in antennas]
    counts = [part.dense()[0] for part in drive.antennas]

    def direct():
        for antenna, count in zip(at, counts, strict=True):
            log_likelihood(trained.field, antenna, count, N_CYCLES, K_PRIME)

    def ours():
        track(ready, state, drive, N_STEPS + 1, estimates)

    # Who is fast must also be right: the robot is where the filter has it, to a few times its usual error.
    ours()
    assert np.hypot(*(estimates[-1, :2] - drive.true_poses[-1, :2])) < 1000.0
    best = race({"ours": ours, "direct": direct}, 5)
    n = trained.field.n_snapshots
    board.rows.append(
        Row(
            f"update by snapshots, {n:,} of them trained", "ms", 1e3 * best["ours"] / N_STEPS,
            {"direct evaluation": 1e3 * best["direct"], "the bar": BAR_MS},
            (("direct evaluation", 20, True), ("the bar", 1, False)),
        )
    )  # fmt: skip
    benchmark.pedantic(ours, rounds=3)


def test_the_memory_of_a_training_map(board):
    """Ten drives: more than the 7,000 snapshots of 400 tags that the bar speaks of."""
    file = load_reproduction("uhf-snapshots").file
    data = data_set(file, LAB, 1, N_CYCLES)
    assert sum(len(part) for log in data.logs for part in log.antennas) > 7000
    trained = train(list(data.logs), data.scene.floor.navigable, np.array(file.drive.settings().mountings))
    table = tabulate(trained.field, data.scene.floor.navigable.buffer(400), file.filter.grid())
    for name, n_bytes in (("training map", trained.field.n_bytes), ("look-up table", table.n_bytes)):
        board.rows.append(
            Row(
                f"{name}, {trained.field.n_snapshots:,} snapshots of {trained.field.n_tags} tags", "MB", n_bytes / 1e6,
                {"the bar": BAR_MB}, (("the bar", 1, False),),
            )
        )  # fmt: skip
        assert n_bytes < 1e6 * BAR_MB
