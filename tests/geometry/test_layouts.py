import math

import numpy as np
import pytest

from rfiddesign.geometry import LAYOUTS, ReaderLayout, make_layout
from rfiddesign.geometry.layouts import bar, cross, grid, lattice_cross, listed, ring, single


def positions(layout):
    return {(x, y) for x, y, _ in layout.poses}


@pytest.mark.parametrize("name", LAYOUTS)
def test_the_papers_crosses_have_the_readers_of_their_name_and_are_symmetric(name):
    layout = make_layout(name)
    assert layout.name == name
    assert layout.n_readers == int(name.removeprefix("cross-")) == len(positions(layout))
    assert positions(layout) == {(-x, y) for x, y in positions(layout)} == {(x, -y) for x, y in positions(layout)}
    assert not layout.poses_mm[:, 2].any()


def test_the_cross_of_eight_lies_on_the_axes():
    expected = {(sign * d, 0) for sign in (1, -1) for d in (150, 250)}
    assert positions(make_layout("cross-8")) == expected | {(y, x) for x, y in expected}


def test_the_hollow_cross_of_24_has_arms_of_two_by_three():
    arm = {(x, y) for x in (112.5, 187.5, 262.5) for y in (37.5, -37.5)}
    turns = [arm, {(-y, x) for x, y in arm}, {(-x, -y) for x, y in arm}, {(y, -x) for x, y in arm}]
    assert positions(make_layout("cross-24")) == set.union(*turns)


def test_the_solid_cross_of_20_is_the_cross_of_24_without_its_outer_eight_and_with_four_in_the_centre():
    hollow, solid = positions(make_layout("cross-24")), positions(make_layout("cross-20"))
    assert {max(map(abs, place)) for place in hollow - solid} == {262.5}
    assert solid - hollow == {(x, y) for x in (37.5, -37.5) for y in (37.5, -37.5)}
    by_arms = cross(readers_per_arm=2, first_mm=112.5, spacing_mm=75, width=2, with_centre=True)
    assert positions(by_arms) == solid


def test_the_cross_of_96_is_one_lattice_14_long_and_4_wide():
    x, y = make_layout("cross-96").poses_mm[:, :2].T
    assert x.max() - x.min() == pytest.approx(13 * 44.5)
    assert y.max() - y.min() == pytest.approx(13 * 37.5)
    np.testing.assert_allclose(np.unique(np.round(np.diff(np.unique(x)), 6)), [44.5])
    np.testing.assert_allclose(np.unique(np.round(np.diff(np.unique(y)), 6)), [37.5])
    ends_x, ends_y = np.sum(x == x.max()), np.sum(y == y.max())
    assert (ends_x, ends_y) == (4, 4)


def test_three_arms_stand_a_third_of_a_turn_apart():
    x, y = cross(arms=3, readers_per_arm=1, first_mm=100).poses_mm[:, :2].T
    np.testing.assert_allclose(np.degrees(np.arctan2(y, x)) % 360, [0, 120, 240], atol=1e-6)
    np.testing.assert_allclose(np.hypot(x, y), 100)


def test_a_bar_lies_across_the_robot_and_a_grid_is_centred():
    assert positions(bar(3, 55)) == {(0, -55), (0, 0), (0, 55)}
    assert positions(grid(2, 1, 80, 50)) == {(-40, 0), (40, 0)}
    assert grid(4, 5, 10, 20).n_readers == 20
    np.testing.assert_allclose(grid(4, 5, 10, 20).poses_mm.mean(axis=0), 0, atol=1e-12)
    assert positions(single()) == {(0, 0)}


def test_the_antennas_of_a_ring_face_outward():
    poses = ring(5, 200).poses_mm
    outward = np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=-1)
    np.testing.assert_allclose(poses[:, :2], 200 * outward, atol=1e-6)


def test_a_list_of_ones_own_may_leave_out_the_yaw():
    assert listed([(10, 20), (30, 40, 0.5)]).poses == ((10, 20, 0), (30, 40, 0.5))


def test_a_layout_is_built_from_a_study_s_table_and_named_by_kind_and_number():
    layout = make_layout({"kind": "bar", "n": 8, "spacing_mm": 55.0})
    assert layout.name == "bar-8"
    assert layout.poses == bar(8, 55.0).poses
    assert make_layout({"kind": "bar", "n": 8, "spacing_mm": 55.0, "name": "front"}).name == "front"
    assert make_layout({"kind": "list", "poses": [[0, 0], [50, 0, math.pi]]}).n_readers == 2
    assert make_layout({"kind": "single"}).n_readers == 1


def test_equal_layouts_are_equal_and_hashable():
    assert make_layout("cross-8") == make_layout("cross-8")
    assert len({make_layout("cross-8"), make_layout("cross-8"), make_layout("cross-20")}) == 2


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("cross-9", "layout = 'cross-9': must be one of cross-96, cross-24, cross-20, cross-8"),
        ({"n": 8}, "layout kind = None: must be one of cross, "),
        ({"kind": ["bar"]}, r"layout kind = \['bar'\]: must be one of"),
        ({"kind": "bar", "n": 8}, "layout key 'spacing_mm' is missing"),
        ({"kind": "bar", "n": 8, "pitch": 5}, "layout key = 'pitch': must be one of kind, name, n, spacing_mm"),
        ({"kind": "bar", "n": 0, "spacing_mm": 5}, "n = 0: must be a whole number from 1"),
        ({"kind": "bar", "n": 2.5, "spacing_mm": 5}, "n = 2.5: must be a whole number"),
        ({"kind": "bar", "n": 2, "spacing_mm": -5}, "spacing_mm = -5: must be a finite number above 0"),
        ({"kind": "bar", "n": 2, "spacing_mm": "5"}, "spacing_mm = '5': must be"),
        ({"kind": "grid", "n_x": 9000, "n_y": 9000, "spacing_x_mm": 1, "spacing_y_mm": 1}, "number of antennas = 81"),
        ({"kind": "ring", "n": 4, "radius_mm": math.inf}, "radius_mm = inf: must be"),
        ({"kind": "cross", "with_centre": "no"}, "with_centre = 'no': must be true or false"),
        ({"kind": "list", "poses": []}, "number of antennas = 0"),
        ({"kind": "list", "poses": [[1, 2, 3, 4]]}, "poses, antenna 1"),
        ({"kind": "list", "poses": [[1, math.nan]]}, "poses, antenna 1, y = nan"),
        ({"kind": "list", "poses": 3}, "poses = 3: must be a list"),
        ({"kind": "list", "poses": ["ab"]}, "poses, antenna 1, x = 'a'"),
    ],
)
def test_bad_layouts_are_refused_with_what_is_allowed(spec, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        make_layout(spec)


def test_a_solid_cross_needs_bars_that_share_their_centre():
    assert lattice_cross(5, 1, 10, 10).n_readers == 9
    with pytest.raises(ValueError, match="width = 2: must be"):
        lattice_cross(5, 2, 10, 10)


def test_a_layout_without_antennas_is_refused():
    with pytest.raises(ValueError, match="number of antennas = 0"):
        ReaderLayout("none", ())
