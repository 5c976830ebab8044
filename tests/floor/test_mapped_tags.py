"""A learned map as a tag map of its own, or over a plan."""

import numpy as np
import pytest

from rfiddesign.floor import visible_tags
from rfiddesign.floor.mapped_tags import MappedTags, mapped_tags

TAGS = mapped_tags([1, 4], [(10.0, 20.0), (500.0, -3.0)], [np.eye(2) * 4.0, np.eye(2)], [3, 7])


def test_mapped_tags_take_the_place_of_planned_ones():
    planned = np.arange(12.0).reshape(6, 2)
    places = TAGS.over(planned)
    assert places[[1, 4]].tolist() == [[10.0, 20.0], [500.0, -3.0]]
    assert np.array_equal(places[[0, 2, 3, 5]], planned[[0, 2, 3, 5]])
    assert planned[1].tolist() == [2.0, 3.0]
    with pytest.raises(ValueError, match="planned_mm has 4 tags, but tag 4"):
        TAGS.over(planned[:4])


def test_a_map_of_its_own_has_believed_places_as_plan_and_true_ones_as_truth():
    tag_map = TAGS.tag_map(np.array([[12.0, 20.0], [480.0, 0.0]]))
    assert visible_tags(tag_map, 12.0, 20.0, 1.0).tolist() == [0]
    by_id = np.argsort(tag_map.tag_id)
    assert tag_map.nominal_x[by_id].tolist() == [10.0, 500.0]
    assert TAGS.tag_map().n_tags == 2
    assert mapped_tags([], [], [], []).tag_map().n_tags == 0


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"tag_id": np.array([4, 1])}, "rise"),
        ({"mean_mm": np.zeros((3, 2))}, "shapes"),
        ({"covariance_mm2": np.full((2, 2, 2), np.inf)}, "finite"),
    ],
)
def test_what_does_not_fit_is_refused(change, named):
    with pytest.raises(ValueError, match=named):
        MappedTags(**{**TAGS.__dict__, **change})
