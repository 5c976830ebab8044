"""The reproduction of snapshots: every row of the tables is there, and training is kept apart from validation."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rfiddesign.errors import StudyError
from rfiddesign.reproduce import load_reproduction, reproduce
from rfiddesign.reproduce.snapshots import _median, _of_runs
from rfiddesign.reproduce.snapshots.config import CountsSection
from rfiddesign.reproduce.snapshots.data import LAB, data_set, folds
from rfiddesign.reproduce.snapshots.experiments import STARTS

TINY = CountsSection(worlds=1, folds=1, validations=1, starts=1, table_factor=4.0)


@cache
def tiny():
    """The study with one short drive for each number."""
    loaded = load_reproduction("uhf-snapshots")
    drive = loaded.file.drive.model_copy(update={"duration_s": 60.0})
    small = loaded.file.model_copy(update={"quick": TINY, "drive": drive})
    return reproduce(replace(loaded, file=small), is_quick=True, n_workers=2)


def rows(table, metric):
    return {row.row: row for row in tiny().rows if (row.table, row.metric) == (table, metric)}


def test_every_row_of_the_tables_is_there():
    for metric in ("median_m", "p90_m", "failure_rate"):
        assert set(rows("table IV", metric)) == {f"{n} {k}" for n in (2, 4, 6, 8) for k in ("20", "50", "k")}
        assert set(rows("table III", metric)) == {f"{n} {d}" for n in (2, 4) for d in ("Lower", "Higher")}
    starts = {f"{name} {n}" for name in STARTS for n in (2, 4)}
    for step in (1, 10):
        assert starts <= set(rows("table II", f"step{step}_median_m"))
    assert all(np.isfinite(row.measured) for row in tiny().rows)


def test_withheld_numbers_are_predictions_and_the_printed_ones_stand_beside():
    medians = rows("table IV", "median_m")
    # Printed in table IV.
    assert medians["2 50"].published == 0.229
    assert medians["4 k"].published == 0.267
    assert all(medians[f"{n} {k}"].published is None for n in (6, 8) for k in ("20", "50", "k"))
    assert all(row.published is None for row in rows("table III", "median_m").values())
    published = load_reproduction("uhf-snapshots").expected.published
    found = {(row.table, row.row, row.metric) for row in tiny().rows}
    assert {(t, r, m) for t, named in published.items() for r, numbers in named.items() for m in numbers} <= found


def test_figures_are_drawn():
    assert set(tiny().figures) == {"laboratory", "corridor", "drive", "table-ii", "table-iv"}


def test_drives_to_train_on_are_never_those_to_localize_on():
    file = load_reproduction("uhf-snapshots").file
    for n in (2, 4, 6, 8):
        for fold in folds(file.n_logs, n, file.full):
            assert len(set(fold.training)) == n
            assert not set(fold.training) & set(fold.validation)
            assert set(fold.training) | set(fold.validation) <= set(range(file.n_logs))


def test_drives_are_as_long_as_the_papers():
    """Sections V and V-B: 89 to 188 m, and at least 2,000 snapshots in N drives, for which one lasts 400 s."""
    file = load_reproduction("uhf-snapshots").file
    for n in (2, 8):
        logs = data_set(file, LAB, 1, n).logs
        assert sum(len(part) for log in logs[:n] for part in log.antennas) >= 2000
        lengths = [np.hypot(*np.diff(log.true_poses[:, :2], axis=0).T).sum() / 1e3 for log in logs]
        assert 89 <= min(lengths) < max(lengths) <= 188


def test_a_median_comes_with_the_spread_of_its_order_statistics():
    values = list(np.random.default_rng(1).normal(size=400))
    median, stderr = _median(values)
    assert median == pytest.approx(np.median(values))
    # Of a normal sample: sqrt(pi / 2) / sqrt(n).
    assert stderr == pytest.approx(1.2533 / 20, rel=0.35)
    assert _of_runs([0.2, 0.3, 1.5, 0.1], 1.0)["failure_rate"][0] == 0.25


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("n_logs = 10", "n_logs = 8", "n_logs is 8, must be at least 9"),
        (
            "least_speed_mm_per_s = 350.0",
            "least_speed_mm_per_s = 900.0",
            "drive: most_speed_mm_per_s is 650.0",
        ),
        ("sigma_mm = 500.0", "sigma_mm = 0.5", "smoothing: sigma_mm is 0.5, must be at least 1"),
        ("least_support = 1.0", "least_support = 1e7", "filter: least_support is 10000000.0, must be"),
        ("fading_db = 6.0", "fading = 6.0", "uhf.fading: unknown key; did you mean fading_"),
    ],
)
def test_a_faulty_study_is_one_line_that_names_file_and_key(tmp_path, old, new, words):
    text = load_reproduction("uhf-snapshots").path.read_text()
    assert old in text
    (tmp_path / "study.toml").write_text(text.replace(old, new))
    with pytest.raises(StudyError) as caught:
        load_reproduction(str(tmp_path))
    assert words in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "study.toml"))
