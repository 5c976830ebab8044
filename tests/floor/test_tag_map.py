"""The tag map finds every tag near a point, and only those."""

import os
import time
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from rfiddesign.errors import StudyError
from rfiddesign.floor import build_tag_map, visible_tags, write_tags_csv


def random_tags(n, seed=1, extent=100_000.0):
    return np.random.Generator(np.random.PCG64(seed)).random((n, 2)) * extent


def brute_force(installed, x, y, reach):
    points = installed.astype(np.float32).astype(float)
    distance2 = (points[:, 0] - x) ** 2 + (points[:, 1] - y) ** 2
    return np.nonzero(distance2 <= reach * reach)[0]


coordinates = st.floats(-2000.0, 2000.0, width=32) | st.sampled_from([0.0, 100.0, 200.0])


@settings(max_examples=200, deadline=None)
@given(
    points=hnp.arrays(float, st.tuples(st.integers(0, 60), st.just(2)), elements=coordinates),
    x=coordinates,
    y=coordinates,
    reach=st.sampled_from([0.0, 30.0, 100.0, 500.0, 5000.0]),
)
def test_lookup_is_brute_force(points, x, y, reach):
    tag_map = build_tag_map(points)
    assert np.array_equal(visible_tags(tag_map, x, y, reach), brute_force(points, x, y, reach))
    assert tag_map.n_tags == len(points)
    assert tag_map.n_x * tag_map.n_y <= 2 * len(points) + 2
    assert tag_map.cell_start[-1] == len(points)


def test_lookup_is_by_the_installed_place_and_the_map_keeps_the_planned_one():
    nominal = random_tags(2000)
    installed = nominal + 500.0
    tag_map = build_tag_map(nominal, installed)
    for x, y in ((500.0, 500.0), (40_000.0, 60_000.0), (100_400.0, 90.0)):
        assert np.array_equal(visible_tags(tag_map, x, y, 3000.0), brute_force(installed, x, y, 3000.0))
    assert np.array_equal(tag_map.nominal_x, nominal[tag_map.tag_id, 0].astype(np.float32))
    assert np.array_equal(tag_map.installed_y, installed[tag_map.tag_id, 1].astype(np.float32))


def test_tags_lie_in_the_cell_that_the_documented_rule_gives():
    tag_map = build_tag_map(random_tags(5000))
    column = ((tag_map.installed_x.astype(float) - tag_map.origin_mm[0]) / tag_map.cell_mm).astype(int)
    row = ((tag_map.installed_y.astype(float) - tag_map.origin_mm[1]) / tag_map.cell_mm).astype(int)
    cell = row * tag_map.n_x + column
    counts = np.diff(tag_map.cell_start)
    assert np.array_equal(cell, np.repeat(np.arange(len(counts)), counts))
    assert counts.max() <= 8  # half a tag per cell of the box on average


def test_lattices_and_lines_of_tags_keep_cells_small():
    x, y = np.meshgrid(np.arange(0.0, 30_000.0, 100.0), np.arange(0.0, 20_000.0, 100.0))
    line = np.column_stack([np.arange(0.0, 1e6, 100.0), np.zeros(10_000)])
    for points in (np.column_stack([x.ravel(), y.ravel()]), line, line[:, ::-1]):
        tag_map = build_tag_map(points)
        assert np.diff(tag_map.cell_start).max() <= 2
        assert len(tag_map.cell_start) <= 2 * len(points) + 3


def test_a_million_tags_build_within_a_second_and_two_hundred_megabytes():
    points = random_tags(1_000_000)
    started = time.process_time()
    build_tag_map(points, points)
    assert time.process_time() - started < 1.5  # 0.5 s; the rest is for a busy machine
    tracemalloc.start()
    build_tag_map(points, points)
    assert tracemalloc.get_traced_memory()[1] < 200e6
    tracemalloc.stop()


def test_csv_lists_the_planned_places_by_id(tmp_path):
    points = np.array([[300.04, 20.0], [0.0, 10.06], [-5.0, 900.0]])
    write_tags_csv(tmp_path / "tags.csv", build_tag_map(points, points[::-1] + 7.0))
    assert (tmp_path / "tags.csv").read_text() == "id,x_mm,y_mm\n0,300.0,20.0\n1,0.0,10.1\n2,-5.0,900.0\n"
    assert os.listdir(tmp_path) == ["tags.csv"]


def test_csv_of_many_tags_reads_back(tmp_path):
    points = random_tags(250_000)
    write_tags_csv(tmp_path / "tags.csv", build_tag_map(points))
    rows = np.loadtxt(tmp_path / "tags.csv", delimiter=",", skiprows=1)
    assert np.array_equal(rows[:, 0], np.arange(250_000))
    assert np.abs(rows[:, 1:] - points).max() < 0.06


def test_an_unwritable_csv_is_one_line_and_leaves_nothing(tmp_path):
    tag_map = build_tag_map(random_tags(10))
    with pytest.raises(StudyError, match=r"absent/tags.csv: cannot be written"):
        write_tags_csv(tmp_path / "absent" / "tags.csv", tag_map)
    (tmp_path / "tags.csv").mkdir()
    with pytest.raises(StudyError, match=r"tags.csv: cannot be written"):
        write_tags_csv(tmp_path / "tags.csv", tag_map)
    assert os.listdir(tmp_path) == ["tags.csv"]


@pytest.mark.parametrize(
    ("nominal", "installed", "argument"),
    [
        (np.zeros(4), None, "nominal_mm"),
        (np.zeros((4, 3)), None, "nominal_mm"),
        (np.array([[np.nan, 0.0]]), None, "nominal_mm"),
        (np.array([[1e9, 0.0]]), None, "nominal_mm"),
        (np.array([["a", "b"]]), None, "nominal_mm"),
        (np.zeros((4, 2)), np.zeros((3, 2)), "installed_mm"),
        (np.zeros((1, 2)), np.array([[np.inf, 0.0]]), "installed_mm"),
    ],
)
def test_a_bad_argument_is_named(nominal, installed, argument):
    with pytest.raises(ValueError, match=argument):
        build_tag_map(nominal, installed)
