"""A reproduction from its files to its rows, and the files it leaves behind."""

import csv
import json

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.reproduce import load_reproduction, reproduce, write_reproduction

KEYS = ("table", "row", "metric", "published", "measured", "stderr", "unit")


def test_every_metric_of_every_row_stands_beside_what_was_published(write):
    found = reproduce(load_reproduction(str(write())), n_workers=1)
    assert [(row.table, row.row, row.metric) for row in found.rows] == [
        ("table 1", "MCL", "x_mm"),
        ("table 1", "MCL", "position_mm_var"),
        ("table 1", "MCL", "theta_rmse_deg"),
        ("table 1", "odometry", "x_mm"),
        ("table 1", "odometry", "rmse_mm"),
    ]
    assert [row.published for row in found.rows] == [1.25, None, None, None, None]
    assert [row.unit for row in found.rows] == ["mm", "mm^2", "deg", "mm", "mm"]
    assert all(row.measured > 0 and row.stderr > 0 for row in found.rows)
    assert (found.name, found.title, found.is_quick) == ("tiny", "A tiny published system", False)
    # The second claims a metric that is not measured.
    assert [claim.holds for claim in found.claims] == [True, False]
    assert found.claims[1].measured is None
    assert found.figures == {}


def test_the_rows_do_not_depend_on_the_number_of_workers(write):
    loaded = load_reproduction(str(write()))
    assert reproduce(loaded, n_workers=1).rows == reproduce(loaded, n_workers=2).rows


def test_rows_follow_the_seed(write):
    ours, another = (reproduce(load_reproduction(str(write(*change)))) for change in ((), ("seed = 3", "seed = 4")))
    assert ours.rows[0].measured != another.rows[0].measured


def test_runs_are_those_of_the_row_or_of_the_study_and_fewer_if_quick(write):
    loaded = load_reproduction(str(write()))
    for is_quick, expected in ((False, [4, 3]), (True, [2, 2])):
        seen = []
        reproduce(loaded, is_quick=is_quick, n_workers=2, on_progress=lambda *step, seen=seen: seen.append(step))
        names = ("table 1, MCL (1 of 2)", "table 1, odometry (2 of 2)")
        assert seen == [
            (name, done + 1, n) for name, n in zip(names, expected, strict=True) for done in range(n)
        ]  # fmt: skip


def test_an_unknown_metric_is_named_before_anything_is_simulated(write):
    folder = write('["x_mm", "rmse_mm"]', '["x_mm", "rmse_m"]')
    seen = []
    with pytest.raises(StudyError) as caught:
        reproduce(load_reproduction(str(folder)), on_progress=lambda *step: seen.append(step))
    words = "rows (table 1, odometry).metrics: found 'rmse_m', must be one of x_mm, y_mm, theta_rad, "
    assert str(caught.value).startswith(f"{folder / 'study.toml'}: {words}")
    assert seen == []


def test_rows_are_written_as_json_and_csv(write, tmp_path):
    found = reproduce(load_reproduction(str(write())), is_quick=True)
    write_reproduction(found, tmp_path / "out")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["rows.csv", "rows.json"]
    saved = json.loads((tmp_path / "out" / "rows.json").read_text(), parse_constant=pytest.fail)
    assert saved == found.as_json()
    assert set(saved) == {"study", "title", "is_quick", "rows", "claims"}
    assert all(tuple(row) == KEYS for row in saved["rows"])
    with (tmp_path / "out" / "rows.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    assert [tuple(row) for row in table] == [KEYS] * 5
    for row, record in zip(table, saved["rows"], strict=True):
        assert [row[key] for key in KEYS[:3]] == [record[key] for key in KEYS[:3]]
        assert (float(row["measured"]), float(row["stderr"])) == (record["measured"], record["stderr"])
        assert row["published"] == ("" if record["published"] is None else str(record["published"]))


@pytest.mark.parametrize("start", ["=", "+", "-", "@"])
def test_no_name_can_be_taken_for_a_formula(write, tmp_path, start):
    name = f"{start}HYPERLINK(A1)"
    found = reproduce(load_reproduction(str(write('row = "odometry"', f'row = "{name}"'))), is_quick=True)
    write_reproduction(found, tmp_path / "out")
    with (tmp_path / "out" / "rows.csv").open(newline="") as file:
        names = {row["row"] for row in csv.DictReader(file)}
    assert names == {"MCL", f"'{name}"}
    # JSON has no formulas.
    assert name in (tmp_path / "out" / "rows.json").read_text()


def test_a_name_does_not_begin_with_a_tab(write):
    with pytest.raises(StudyError, match="string should match pattern"):
        load_reproduction(str(write('row = "odometry"', 'row = "\\t=1"')))


def test_a_row_without_numbers_is_empty_and_not_nan(write, tmp_path):
    """Errors count only while the robot stands, and it never does."""
    folder = write('estimator = "odometry"', 'estimator = "odometry", scores_standing_only = true')
    found = reproduce(load_reproduction(str(folder)), is_quick=True)
    write_reproduction(found, tmp_path / "out")
    saved = json.loads((tmp_path / "out" / "rows.json").read_text(), parse_constant=pytest.fail)
    assert [row["measured"] for row in saved["rows"] if row["row"] == "odometry"] == [None, None]
    assert "nan" not in (tmp_path / "out" / "rows.csv").read_text()
