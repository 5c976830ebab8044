"""What the look-up table takes and saves: interleaved timings on one thread, the least of many rounds."""

import time

import numpy as np

from rfiddesign.estimators.snapshot import build, init, log_likelihood, track
from rfiddesign.estimators.verbs import N_ESTIMATE
from rfiddesign.geometry import compose
from rfiddesign.models.snapshots import SnapshotLog, part_of
from rfiddesign.reproduce.rows import Row, unit_of
from rfiddesign.reproduce.snapshots.config import SnapshotsFile
from rfiddesign.reproduce.snapshots.data import LAB, data_set
from rfiddesign.reproduce.snapshots.experiments import K
from rfiddesign.simulation.snapshot_run import Trained, train

TABLE = "look-up table"
N_CYCLES = 2
# Training snapshots that the paper's map had at least, and that of the speed that is asked for.
SIZES = (2000, 7000)
N_ROUNDS, N_QUICK_ROUNDS, N_STEPS = 7, 2, 20


def speed_rows(file: SnapshotsFile, *, is_quick: bool) -> list[Row]:
    """Time and memory of the table and of direct evaluation."""
    rows = []
    data = data_set(file, LAB, 1, N_CYCLES)
    antennas = np.array(file.drive.settings().mountings)
    for size in SIZES[:1] if is_quick else SIZES:
        logs, left = [], size
        for log in data.logs[:-1]:
            n = min(len(log), -(-left // len(antennas)))
            logs.append(part_of(log, 0, n))
            left -= n * len(antennas)
            if left <= 0:
                break
        trained = train(logs, data.scene.floor.navigable, antennas, file.smoothing.smoothing(), file.filter.grid())
        table_s, direct_s = _times(file, trained, data.logs[-1], antennas, N_QUICK_ROUNDS if is_quick else N_ROUNDS)
        metrics = {
            "n_snapshots": trained.field.n_snapshots,
            "table_ms": 1e3 * table_s,
            "direct_ms": 1e3 * direct_s,
            "speedup": direct_s / table_s,
            "table_mb": trained.table.n_bytes / 1e6,
            "training_map_mb": trained.field.n_bytes / 1e6,
        }
        row = f"{size:,} snapshots"
        rows += [Row(TABLE, row, name, None, float(value), None, unit_of(name)) for name, value in metrics.items()]
    return rows


def _times(
    file: SnapshotsFile, trained: Trained, log: SnapshotLog, antennas: np.ndarray, n_rounds: int
) -> tuple[float, float]:
    """Times [s] of an update of all particles: a whole step of the filter with the table, the likelihood without.

    That is in favour of direct evaluation: what the filter does beside weighing counts on the table's side alone.
    """
    settings = file.filter.settings(K)
    drive = part_of(log, 0, N_STEPS + 1)
    ready = build(settings, trained.table, antennas, trained.drivable, list(trained.logs), N_CYCLES)
    state, estimates = init(ready, drive, 1), np.empty((N_STEPS + 1, N_ESTIMATE))
    # Particles about where the robot is, as in the midst of a run.
    rng = np.random.default_rng(0)
    poses = drive.true_poses[0] + rng.normal(size=(settings.n_particles, 3)) * [200.0, 200.0, 0.1]
    at = [compose(poses, mounting) for mounting in antennas]
    counts = [part.dense()[0] for part in drive.antennas]
    best_table, best_direct = np.inf, np.inf
    for _ in range(n_rounds):
        begin = time.perf_counter()
        track(ready, state, drive, N_STEPS + 1, estimates)
        best_table = min(best_table, (time.perf_counter() - begin) / N_STEPS)
        begin = time.perf_counter()
        for antenna, count in zip(at, counts, strict=True):
            log_likelihood(trained.field, antenna, count, N_CYCLES, K)
        best_direct = min(best_direct, time.perf_counter() - begin)
    return best_table, best_direct
