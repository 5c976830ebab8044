"""First reads against shapely, and what is swept."""

import math

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.catalog import Antenna, antenna
from rfiddesign.geometry import Disc, Rectangle, make_pattern
from rfiddesign.optimize.reader_placement import PlacementProblem
from rfiddesign.optimize.reader_placement.motion import half_planes, sweeps

MOUNTS = np.array([[0.0, 0.0], [120.0, -60.0], [-200.0, 75.0]])


def problem(area, motions, pattern="square", pitch_mm=180.0, distance_mm=260.0, turn_deg=140.0):
    return PlacementProblem(
        Antenna("test", (60.0, 60.0), area, "test"), make_pattern(pattern, pitch_mm=pitch_mm), distance_mm, 320.0,
        motions=motions, turn_deg=turn_deg,
    )  # fmt: skip


def moved(shape, pose):
    return shapely.affinity.translate(shapely.affinity.rotate(shape, pose[2], (0, 0), use_radians=True), *pose[:2])


def marched(problem, sweep, pose, mount, n_steps=800):
    """Share of the motion at which a tag is first seen, looking at so many places; inf if none is."""
    lattice, area = problem.lattice, problem.antenna.area
    tags = lattice.points_in((pose[0] - 900, pose[1] - 900, pose[0] + 900, pose[1] + 900))
    for share in np.linspace(0, 1, n_steps + 1):
        heading = pose[2] + share * sweep.turn
        course = heading + sweep.course
        place = pose[:2] + share * sweep.distance * np.array([math.cos(course), math.sin(course)])
        cos, sin = math.cos(heading), math.sin(heading)
        offset = (tags - place) @ np.array([[cos, -sin], [sin, cos]]) - mount
        if area.contains(offset).any():
            return share
    return math.inf


@settings(max_examples=25, deadline=None)
@given(
    st.tuples(st.floats(-300, 300), st.floats(-300, 300), st.floats(0, 7)),
    st.sampled_from([Disc(30.0), Rectangle(90.0, 50.0)]),
    st.sampled_from(["square", "triangular", "striped"]),
)
def test_first_reads_are_those_of_marching(pose, area, pattern):
    motions = ("forward", "sideways") + (("turning",) if isinstance(area, Disc) else ())
    asked = problem(area, motions, pattern)
    for sweep in sweeps(asked):
        found = sweep.first_reads(np.array([pose]), asked.basis, MOUNTS)[0]
        for mount, share in zip(MOUNTS, found, strict=True):
            expected = marched(asked, sweep, np.array(pose), mount)
            if math.isfinite(expected):
                # Marching sees a tag up to one step late.
                assert expected - 1 / 800 - 1e-4 <= share <= expected + 1e-4
            elif math.isfinite(share):
                # It steps over a view that is shorter than its step: the read must be at the rim of the area.
                assert marched(asked, sweep, np.array(pose), mount, 40_000) - share < 1e-3


@pytest.mark.parametrize("area", [Rectangle(90.0, 50.0), antenna("320x230").area])
@pytest.mark.parametrize("motion", ["forward", "sideways"])
def test_what_a_rectangle_sweeps_is_the_hull_of_its_first_and_last_place(area, motion):
    (sweep,) = sweeps(problem(area, (motion,)))
    way = (260.0, 0.0) if motion == "forward" else (0.0, 260.0)
    swept = shapely.union_all([area.outline(), shapely.affinity.translate(area.outline(), *way)]).convex_hull
    points = np.random.default_rng(1).uniform(-400, 600, (2000, 2))
    inside = (points @ sweep.swept[:, :2].T <= sweep.swept[:, 2]).all(axis=1)
    assert inside.tolist() == shapely.contains_xy(swept, points).tolist()
    assert sweep.area == pytest.approx(swept.area)
    assert sweep.width == pytest.approx(swept.area / np.ptp(shapely.get_coordinates(swept) @ way / 260.0))


def test_half_planes_hold_the_corners_and_their_normals_have_length_1():
    shape = shapely.MultiPoint([(0, 0), (3, 0), (1, 2), (1, 1), (3, 2)])
    planes = half_planes(shape)
    corners = shapely.get_coordinates(shape)
    assert len(planes) == 4
    assert np.hypot(*planes[:, :2].T) == pytest.approx(1.0)
    assert (corners @ planes[:, :2].T <= planes[:, 2] + 1e-12).all()
