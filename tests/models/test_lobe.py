"""Lobes: contours of equal signal that keep their shape, and what polls at several distances say."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rfiddesign.models.lobe import Lobe

ahead = st.tuples(st.floats(1.0, 5000.0), st.floats(-5000.0, 5000.0))
shape = st.sampled_from([Lobe(), Lobe(ratio=1.2), Lobe("sector"), Lobe("sector", beam_deg=30.0)])


@given(shape, ahead, st.floats(0.1, 10.0))
def test_a_place_twice_as_far_needs_twice_the_distance(lobe, place, factor):
    needed = lobe.needed_mm(place)
    assert lobe.needed_mm(np.array(place) * factor) == pytest.approx(factor * needed, rel=1e-9)
    assert lobe.needed_mm((place[0], -place[1])) == pytest.approx(needed)
    assert needed >= place[0]


@given(st.floats(100.0, 5000.0), st.floats(-1.0, 1.0), st.floats(0.1, 1.0))
def test_an_ellipse_has_one_end_of_its_long_axis_at_the_antenna(length, part, ratio):
    """All places on it need its length."""
    angle = part * 3.1
    place = (0.5 * length * (1 + math.cos(angle)), 0.5 * ratio * length * math.sin(angle))
    assert Lobe(ratio=ratio).needed_mm(place) == pytest.approx(length, rel=1e-6)


@pytest.mark.parametrize("beam", [30.0, 70.0, 120.0])
def test_a_sector_has_half_the_gain_at_the_edge_of_its_beam(beam):
    """Out and back through the gain: a quarter of the signal, thus the fourth root of 4 times the distance."""
    edge = math.radians(beam / 2)
    needed = Lobe("sector", beam_deg=beam).needed_mm((1000 * math.cos(edge), 1000 * math.sin(edge)))
    assert needed == pytest.approx(1000.0 * 4 ** (1 / 4))


def test_nothing_is_read_behind_the_antenna():
    assert Lobe().needed_mm((-100.0, 0.0)) == math.inf
    assert Lobe(softness=0.2).probability((-100.0, 0.0), 2000.0) == 0.0


def test_a_soft_lobe_reads_half_of_what_is_on_its_contour():
    lobe = Lobe(softness=0.1, read_probability=0.8)
    assert lobe.probability((1500.0, 0.0), 1500.0) == pytest.approx(0.4)
    assert lobe.probability((500.0, 0.0), 1500.0) == pytest.approx(0.8)
    # A read more likely than not if the distance needed is drawn from a lognormal: by counting.
    rng = np.random.default_rng(1)
    needed = 1500.0 * np.exp(0.1 * rng.standard_normal(200_000))
    assert lobe.probability((1500.0, 0.0), 1600.0) == pytest.approx(0.8 * (needed <= 1600.0).mean(), abs=0.004)


def test_the_words_of_a_poll_at_several_distances_have_the_chances_that_counting_gives():
    lobe, distances = Lobe("sector", softness=0.15, read_probability=0.7), (700.0, 1000.0, 1400.0)
    field = lobe.log_field(distances, 50.0)
    rng = np.random.default_rng(2)
    for place in ((525.0, 150.0), (925.0, -400.0), (1325.0, 0.0)):
        chances = lobe.probability(np.array(place), np.array(distances))
        answers = rng.random((400_000, 3)) < chances
        first = np.where(answers.any(axis=1), answers.argmax(axis=1), 3)
        u = round((place[0] - field.low_u) / 50.0)
        v = round((place[1] - field.low_v) / 50.0)
        told = np.exp(field.tables[:, u, v].astype(float) + field.far)
        shares = np.bincount(first, minlength=4) / first.size
        assert told[1:] == pytest.approx(np.maximum(shares, 1e-3), abs=3e-3)
        assert told[0] == pytest.approx(shares[:3].sum(), abs=3e-3)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: Lobe("cone"), "shape"),
        (lambda: Lobe(beam_deg=180.0), "beam_deg"),
        (lambda: Lobe(softness=-0.1), "softness"),
        (lambda: Lobe(ratio=math.nan), "ratio"),
        (lambda: Lobe(softness=0.1, read_probability=0.9).log_field((2000.0,), 0.1), "cell_mm"),
        (lambda: Lobe().log_field((2000.0,), 50.0), "probability"),
    ],
)
def test_what_cannot_be_is_refused_by_name(make, named):
    with pytest.raises(ValueError, match=named):
        make()
