"""Localization on data sets: tables II to IV of uhf_snapshots, and what their numbers hang on."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial

import numpy as np

from rfiddesign.models.snapshots import part_of
from rfiddesign.numerics._noise_kernels import run_key
from rfiddesign.reproduce.snapshots.config import CountsSection, SnapshotsFile
from rfiddesign.reproduce.snapshots.data import HIGHER, LAB, LOWER, DataSet, Fold, data_set, folds, world_of
from rfiddesign.simulation.snapshot_run import Trained, localize, train

CYCLES, K_PRIMES, K = (2, 4, 6, 8), (20, 50, None), 50
FEW_CYCLES = (2, 4)
DENSITIES = {"Lower": LOWER, "Higher": HIGHER}
STARTS = {
    "Uniform distribution": ("uniform", None), "Uniform + boosting": ("uniform", 10_000),
    "Snapshot sampling": ("snapshots", None),
}  # fmt: skip
#: Steps after which table II looks.
STEPS = (1, 10)
#: Weights of the heading in the kernel's metric beside that of the study [deg].
SIGMAS_DEG = (30.0, 45.0, 90.0)
# Folds that are enough to see what a setting does.
_FEW_FOLDS = 2
# How far beyond the floor particles may be that nothing keeps to it.
_AROUND_MM = 2000.0

#: Mean errors of runs [m] by (table, row).
Errors = dict[tuple[str, str], list[float]]


def tasks(file: SnapshotsFile, *, is_quick: bool) -> list[Callable[[], Errors]]:
    """All that is to be simulated, in parts that need nothing of each other."""
    counts = file.counts(is_quick=is_quick)
    found: list[Callable[[], Errors]] = []
    for world in range(1, counts.worlds + 1):
        found += [partial(_lab, file, counts, world, n) for n in CYCLES]
        found += [partial(_corridor, file, counts, world, n, name) for n in FEW_CYCLES for name in DENSITIES]
        found += [partial(_settings, file, counts, world, n) for n in FEW_CYCLES]
    return found


def k_name(k_prime: int | None) -> str:
    """k' as the tables write it."""
    return "k" if k_prime is None else str(k_prime)


def _lab(file: SnapshotsFile, counts: CountsSection, world: int, n: int) -> Errors:
    """Table IV, and table II where N is small."""
    data, errors = data_set(file, LAB, world, n), {}
    for fold in folds(file.n_logs, n, counts):
        trained = _train(data, fold, counts)
        for k_prime in K_PRIMES:
            found = _mean_errors(data, fold, trained, k_prime)
            _add(errors, [("table IV", f"{n} {k_name(k_prime)}")], found)
            _add(errors, [("table IV by world", f"world {world}: {n} {k_name(k_prime)}")], found)
        if n in FEW_CYCLES:
            _begin(data, fold, trained, counts, errors)
    return errors


def _begin(data: DataSet, fold: Fold, trained: Trained, counts: CountsSection, errors: Errors) -> None:
    """Table II: errors after few steps of the three ways to begin, at places spread over each drive."""
    for i in fold.validation:
        log = data.logs[i]
        for start in range(counts.starts):
            first = start * (len(log) - STEPS[-1]) // counts.starts
            part = part_of(log, first, first + STEPS[-1])
            key = run_key(np.uint64(data.file.seed + data.world), np.uint64(1000 * i + start + 1))
            for name, (kind, n_particles) in STARTS.items():
                settings = data.file.filter.settings(K, kind, n_particles)
                off = localize(trained, settings, part, key).position_error_mm / 1e3
                for step in STEPS:
                    _add(errors, [(f"table II, step {step}", f"{name} {data.n_cycles}")], [float(off[step - 1])])


def _corridor(file: SnapshotsFile, counts: CountsSection, world: int, n: int, name: str) -> Errors:
    """Table III."""
    data, errors = data_set(file, DENSITIES[name], world, n), {}
    for number, fold in enumerate(folds(file.n_logs, n, counts)):
        trained = _train(data, fold, counts)
        _add(errors, [("table III", f"{n} {name}")], _mean_errors(data, fold, trained, K))
        if (n, name) != (FEW_CYCLES[0], "Higher") or number >= _FEW_FOLDS:
            continue
        for row, is_bounded, is_masked in (
            ("particles anywhere", False, True), ("untrained cells not masked", True, False), ("neither", False, False)
        ):  # fmt: skip
            changed = _train(data, fold, counts, is_masked=is_masked, is_bounded=is_bounded)
            _add(errors, [("settings", f"corridor {n} {K}, {row}")], _mean_errors(data, fold, changed, K))
    return errors


def _settings(file: SnapshotsFile, counts: CountsSection, world: int, n: int) -> Errors:
    """Table IV again with one thing changed, and with the field of the day in place of a learned one."""
    errors: Errors = {}
    counts = counts.model_copy(update={"folds": min(counts.folds, _FEW_FOLDS)})
    data, one_day = data_set(file, LAB, world, n), data_set(file, LAB, world, n, is_one_day=True)
    for fold in folds(file.n_logs, n, counts):
        for sigma in SIGMAS_DEG:
            trained = _train(data, fold, counts, sigma_deg=sigma)
            for k_prime in (K, None):
                row = f"{n} {k_name(k_prime)}, heading {sigma:g} deg"
                _add(errors, [("settings", row)], _mean_errors(data, fold, trained, k_prime))
        same = _train(one_day, fold, counts)
        _add(errors, [("settings", f"{n} {K}, all on one day")], _mean_errors(one_day, fold, same, K))
        # The field is that of the day that is driven on: nothing is left to learn.  A table per drive.
        for i in fold.validation[:1]:
            known, alone = _train(data, fold, counts, day=i), replace(fold, validation=(i,))
            _add(errors, [("settings", f"{n} {K}, true field")], _mean_errors(data, alone, known, K))
    return errors


def _train(
    data: DataSet, fold: Fold, counts: CountsSection, *, sigma_deg: float | None = None, is_masked: bool = True,
    is_bounded: bool = True, day: int | None = None,
) -> Trained:  # fmt: skip
    """What a training set teaches, or the true field of a day."""
    file, scene = data.file, data.scene
    grid = file.filter.grid(counts.table_factor)
    drivable = scene.floor.navigable
    if not is_bounded:
        drivable = drivable.envelope.buffer(_AROUND_MM, join_style="mitre")
    return train(
        [data.logs[i] for i in fold.training], drivable, np.array(file.drive.settings().mountings),
        file.smoothing.smoothing(sigma_deg), grid if is_masked else replace(grid, least_support=0.0),
        None if day is None else world_of(file, data.place, data.world, day),
    )  # fmt: skip


def _mean_errors(data: DataSet, fold: Fold, trained: Trained, k_prime: int | None) -> list[float]:
    """Mean error of each drive that is localized on [m]."""
    settings = data.file.filter.settings(k_prime)
    found = []
    for i in fold.validation:
        key = run_key(np.uint64(data.file.seed + data.world), np.uint64(1000 * i))
        found.append(float(localize(trained, settings, data.logs[i], key).position_error_mm.mean()) / 1e3)
    return found


def _add(errors: Errors, rows: Iterable[tuple[str, str]], found: list[float]) -> None:
    for row in rows:
        errors.setdefault(row, []).extend(found)
