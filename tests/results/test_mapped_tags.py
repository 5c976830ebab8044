"""A learned map as a file that a spreadsheet reads."""

import csv

import numpy as np

from rfiddesign.floor.mapped_tags import mapped_tags
from rfiddesign.results.mapped_tags import mapped_tags_csv


def test_every_cell_below_the_header_is_a_number():
    covariance = np.array([[4.0, -1.5], [-1.5, 9.0]])
    text = mapped_tags_csv(mapped_tags([1, 4], [(-10.04, 20.0), (1e5, -3.0)], [covariance, covariance], [3, 7]))
    header, *lines = csv.reader(text.splitlines())
    assert header == ["tag", "x_mm", "y_mm", "var_x_mm2", "cov_xy_mm2", "var_y_mm2", "n_reads"]
    assert [[float(cell) for cell in line] for line in lines] == [
        [1, -10.0, 20.0, 4.0, -1.5, 9.0, 3],
        [4, 100000.0, -3.0, 4.0, -1.5, 9.0, 7],
    ]


def test_a_map_of_no_tags_has_its_header():
    text = mapped_tags_csv(mapped_tags([], [], [], []))
    assert text.splitlines() == ["tag,x_mm,y_mm,var_x_mm2,cov_xy_mm2,var_y_mm2,n_reads"]
