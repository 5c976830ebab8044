"""Grids of rows: every table with every estimator under every condition, and one line for what is wrong with them."""

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.reproduce import load_reproduction, reproduce
from rfiddesign.reproduce.cases import case_of
from rfiddesign.reproduce.config import MAX_ROWS, GridSection

LAST_LINE = "runs = 3"
GRID = """
[[grids]]
metrics = ["x_mm", "rmse_mm"]
runs = 2
[grids.tables]
dense = { tags_per_m2 = 100.0 }
sparse = { pitch_mm = 250.0, "mcl.n_particles" = 70 }
[grids.estimators]
few = { estimator = "mcl", "mcl.n_particles" = 30 }
none = { estimator = "odometry" }
[grids.only]
none = ["dead"]
[grids.conditions]
matched = {}
dead = { "world.dead_share" = 0.5 }
"""


def grid_of(**changes):
    data = {
        "metrics": ["x_mm"],
        "tables": {"t": {"layout": "single", "dt_s": 0.1}},
        "estimators": {"e": {"dt_s": 0.2, "estimator": "mcl"}},
        "conditions": {"c": {"estimator": "markov"}},
    }
    return GridSection.model_validate(data | changes)


def test_rows_come_table_by_table_and_an_estimator_meets_only_its_conditions(write):
    file = load_reproduction(str(write(LAST_LINE, LAST_LINE + GRID))).file
    assert [(row.table, row.row) for row in file.rows] == [
        ("dense", "few matched"), ("dense", "few dead"), ("dense", "none dead"),
        ("sparse", "few matched"), ("sparse", "few dead"), ("sparse", "none dead"),
        ("table 1", "MCL"), ("table 1", "odometry"),
    ]  # fmt: skip
    assert all((row.metrics, row.runs) == (["x_mm", "rmse_mm"], 2) for row in file.rows[:6])
    assert file.grids[0].n_rows == 6


def test_a_row_of_a_grid_is_the_case_that_its_keys_make(write):
    loaded = load_reproduction(str(write(LAST_LINE, LAST_LINE + GRID)))
    by_hand = loaded.file.rows[-1].model_copy(
        update={"set": {"pitch_mm": 250.0, "mcl.n_particles": 30, "world.dead_share": 0.5}}
    )
    assert case_of(loaded, loaded.file.rows[4]) == case_of(loaded, by_hand)


def test_a_condition_has_the_last_word_and_an_estimator_one_before_that_of_the_table():
    (row,) = grid_of().rows()
    assert row.set == {"layout": "single", "dt_s": 0.2, "estimator": "markov"}


def test_rows_of_a_grid_are_measured_like_any(write):
    alone = reproduce(load_reproduction(str(write())), n_workers=1)
    found = reproduce(load_reproduction(str(write(LAST_LINE, LAST_LINE + GRID))), n_workers=1)
    assert len(found.rows) == 6 * 2 + len(alone.rows)
    assert found.rows[12:] == alone.rows


def test_a_study_may_have_grids_alone(write):
    folder = write(LAST_LINE, LAST_LINE + GRID)
    text = (folder / "study.toml").read_text()
    (folder / "study.toml").write_text(text[: text.index("[[rows]]")] + GRID)
    assert len(load_reproduction(str(folder)).file.rows) == 6


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('none = ["dead"]', 'non = ["dead"]', "grids.0: only names 'non', must be one of few, none"),
        ('none = ["dead"]', 'none = ["deaf"]', "grids.0: only names 'deaf', must be one of matched, dead"),
        ("runs = 2", "rums = 2", "grids.0.rums: unknown key; did you mean runs? allowed: conditions, "),
        ('metrics = ["x_mm", "rmse_mm"]', "", "grids.0.metrics: is missing"),
        ('dead = { "world.dead_share" = 0.5 }', 'dead = { "world.dead_share" = 1.5 }',
         "rows (dense, few dead): world.dead_share: found 1.5; input should be less than or equal to 1"),
        ("matched = {}", f'"{"m" * 50}" = {{}}', "string should have at most 49 characters"),
    ],
)  # fmt: skip
def test_a_faulty_grid_is_one_line(write, old, new, words):
    assert GRID.count(old) == 1
    folder = write(LAST_LINE, LAST_LINE + GRID.replace(old, new))
    with pytest.raises(StudyError) as caught:
        load_reproduction(str(folder))
    line = str(caught.value)
    assert line.startswith(f"{folder / 'study.toml'}: ")
    assert words in line
    assert "\n" not in line


def test_a_grid_and_a_row_do_not_share_a_name(write):
    grid = GRID.replace("dense", '"table 1"').replace("few", "MCL").replace("matched", "x")
    folder = write(LAST_LINE, LAST_LINE + grid)
    text = (folder / "study.toml").read_text()
    (folder / "study.toml").write_text(text.replace('row = "MCL"', 'row = "MCL x"'))
    with pytest.raises(StudyError, match=r"rows names \(table 1, MCL x\) twice"):
        load_reproduction(str(folder))


@pytest.mark.parametrize("name", ["tables", "estimators", "conditions"])
def test_no_dimension_of_a_grid_is_empty(name):
    with pytest.raises(ValueError, match="at least 1 item"):
        grid_of(**{name: {}})


def test_rows_are_counted_before_they_are_written_out(write):
    many = {f"t{i}": {} for i in range(101)}
    grid = grid_of(tables=many, conditions={f"c{i}": {} for i in range(10)})
    assert grid.n_rows == 1010 > MAX_ROWS
    tables = "\n".join(f"t{i} = {{}}" for i in range(1001))
    folder = write(LAST_LINE, LAST_LINE + GRID.replace("dense = { tags_per_m2 = 100.0 }", tables))
    with pytest.raises(StudyError, match=r"rows and grids make 3,008 rows, must be from 1 to 1,000"):
        load_reproduction(str(folder))
    (folder / "study.toml").write_text('title = "t"\nsource = "s"\nrows = []\n')
    with pytest.raises(StudyError, match=r"rows and grids make 0 rows, must be from 1 to 1,000"):
        load_reproduction(str(folder))
