"""What estimators are told of the map, and what they refuse."""

import numpy as np

from rfiddesign.estimators.verbs import known
from rfiddesign.floor import build_tag_map

RNG = np.random.Generator(np.random.PCG64(4))


def tags_by_cell(tags):
    """{cell: planned places} of a map as compiled estimators take it, and for each place the cell that it lies in."""
    x, y, cell_start, per_cell, x0, y0, n_x, n_y = known(tags)
    cell = np.repeat(np.arange(n_x * n_y), np.diff(cell_start))
    expected = np.floor((y - y0) * per_cell).astype(int) * n_x + np.floor((x - x0) * per_cell).astype(int)
    return x, y, cell, expected


def test_estimators_find_tags_where_the_plan_has_them():
    """Also in a map of tags that lie elsewhere in truth: that must not show."""
    plan = RNG.uniform(0, 3000, (400, 2)).astype(np.float32)
    for truth in (None, plan + RNG.normal(0, 50, plan.shape)):
        x, y, cell, expected = tags_by_cell(build_tag_map(plan, truth))
        assert np.array_equal(cell, expected)
        order = np.lexsort((x, y))
        assert np.array_equal(np.column_stack([x, y])[order], plan[np.lexsort(plan.T)])


def test_a_map_is_sorted_anew_once_only():
    plan = RNG.uniform(0, 3000, (40, 2))
    tags = build_tag_map(plan, plan + 5.0)
    assert known(tags)[0] is known(tags)[0]
    as_planned = build_tag_map(plan)
    assert known(as_planned)[0] is as_planned.nominal_x


def test_without_a_map_there_are_no_tags():
    x, y, cell_start, *_, n_x, n_y = known(None)
    assert x.size == y.size == cell_start.sum() == 0
    assert n_x == n_y == 1
