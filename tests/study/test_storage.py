"""Runs on disk: kept whole, found again, refused where the file is not what it should be."""

import sqlite3
from dataclasses import replace

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.metrics import RunMetrics
from rfiddesign.study.storage import RunTable

RUN = RunMetrics(1 / 3, 2.0, 3.0, 4.0, 0.1, 0.2, 0.3, 1e-17, float("inf"), 0.25, 1200)


def test_runs_come_back_to_the_last_bit(tmp_path):
    stopped = replace(RUN, is_complete=False, n_steps=100, convergence_s=0.1 + 0.2)
    with RunTable(tmp_path / "runs.sqlite") as table:
        table.add([(0, 7, 0, RUN), (0, 7, 1, stopped), (0, 3, 0, stopped)])
        assert table.runs() == {(0, 3): [stopped], (0, 7): [RUN, stopped]}
    with RunTable(tmp_path / "runs.sqlite") as table:
        found = table.runs()
    assert found == {(0, 3): [stopped], (0, 7): [RUN, stopped]}
    assert found[0, 7][0].is_complete is True
    assert isinstance(found[0, 7][0].n_steps, int)


def test_runs_after_a_gap_wait_until_it_is_filled(tmp_path):
    with RunTable(tmp_path / "runs.sqlite") as table:
        table.add([(0, 1, 0, RUN), (0, 1, 2, RUN), (0, 2, 1, RUN)])
        assert table.runs() == {(0, 1): [RUN], (0, 2): []}
        table.add([(0, 1, 1, RUN), (0, 2, 0, RUN)])
        assert {design: len(runs) for (_, design), runs in table.runs().items()} == {1: 3, 2: 2}


def test_a_run_stored_twice_is_there_once(tmp_path):
    with RunTable(tmp_path / "runs.sqlite") as table:
        table.add([(0, 1, 0, RUN)])
        table.add([(0, 1, 0, RUN)])
        assert table.runs() == {(0, 1): [RUN]}


def test_an_interruption_between_two_rows_stores_none_of_them_and_the_table_goes_on(tmp_path):
    def rows():
        yield 0, 1, 0, RUN
        raise KeyboardInterrupt

    with RunTable(tmp_path / "runs.sqlite") as table:
        with pytest.raises(KeyboardInterrupt):
            table.add(rows())
        assert table.runs() == {}
        table.add([(0, 1, 0, RUN)])
    with RunTable(tmp_path / "runs.sqlite") as table:
        assert table.runs() == {(0, 1): [RUN]}


def test_a_second_user_is_turned_away(tmp_path):
    path = tmp_path / "runs.sqlite"
    with RunTable(path) as table:
        table.add([(0, 1, 0, RUN)])
        with pytest.raises(StudyError, match=f"{path}: is in use by another run"):
            RunTable(path)


@pytest.mark.parametrize("content", [b"no database at all" * 100, b"SQLite format 3\x00" + bytes(200)])
def test_a_file_that_is_no_database_is_one_line(tmp_path, content):
    path = tmp_path / "runs.sqlite"
    path.write_bytes(content)
    with pytest.raises(StudyError, match=f"{path}: cannot be used: file is not a database"):
        RunTable(path)


def test_a_damaged_page_is_one_line(tmp_path):
    path = tmp_path / "runs.sqlite"
    with RunTable(path) as table:
        table.add([(0, design, 0, RUN) for design in range(500)])
    content = bytearray(path.read_bytes())
    content[8192:] = b"\xff" * (len(content) - 8192)
    path.write_bytes(content)
    with RunTable(path) as table, pytest.raises(StudyError, match=f"{path}: cannot be used: .*malformed"):
        table.runs()


def test_a_database_with_another_table_of_that_name_is_one_line(tmp_path):
    path = tmp_path / "runs.sqlite"
    connection = sqlite3.connect(path)
    connection.execute("CREATE TABLE runs (a)")
    connection.close()
    with RunTable(path) as table, pytest.raises(StudyError, match=f"{path}: cannot be used: no such column"):
        table.runs()


def test_a_folder_that_is_not_there_is_one_line(tmp_path):
    with pytest.raises(StudyError, match=r"runs.sqlite: cannot be used: unable to open database file"):
        RunTable(tmp_path / "no" / "runs.sqlite")
