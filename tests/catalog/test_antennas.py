"""The antennas that a study may name."""

import math

import pytest

from rfiddesign.catalog import Antenna, antenna, antennas
from rfiddesign.geometry import Disc, Rectangle

# Antennas that are not named by their size.
HOUSINGS_MM = {"navifloor": (80.0, 80.0), "smart-floor": (200.0, 200.0)}
# Measured: its signal reaches beyond its housing.
REACHES_FAR = {"navifloor"}


@pytest.mark.parametrize(
    ("name", "area_mm2"),
    [
        # hf_multireader_mcl, eq. 5: sqrt(15^2 - (20 - 8)^2) = 9; the others hang at the height of their centre.
        ("30x30", math.pi * 9.0**2),
        ("60x60", math.pi * 30.0**2),
        ("80x80", math.pi * 40.0**2),
        ("320x230", 320.0 * 230.0),
        ("660x300", 660.0 * 300.0),
        # rssi_kalman_navifloor, table I; markov_kalman_smart_floor, section IV.
        ("navifloor", math.pi * 105.0**2),
        ("smart-floor", math.pi * 100.0**2),
    ],
)
def test_what_an_antenna_sees_of_the_floor(name, area_mm2):
    assert antenna(name).area.area_mm2 == pytest.approx(area_mm2, rel=1e-12)


@pytest.mark.parametrize(("height_mm", "radius_mm"), [(20.0, 9.0), (8.0, 15.0), (17.0, 12.0)])
def test_an_antenna_at_another_height_sees_what_the_floor_cuts_of_its_sphere(height_mm, radius_mm):
    """Of a sphere of 15 mm whose centre is 8 mm below the antenna: eq. 5 of hf_multireader_mcl by hand."""
    moved = antenna("30x30").at_height(height_mm)
    assert moved.area == Disc(radius_mm)
    assert (moved.name, moved.housing_mm) == ("30x30", (30.0, 30.0))
    assert moved.sphere.antenna_height_mm == height_mm
    assert moved.at_height(20.0) == antenna("30x30")


def test_heights_from_which_nothing_is_seen_or_known_are_refused():
    with pytest.raises(ValueError, match=r"antenna 30x30: height is 23, it sees tags from 0 to 23 mm, both left out"):
        antenna("30x30").at_height(23.0)
    with pytest.raises(ValueError, match=r"antenna 320x230: has no detection sphere"):
        antenna("320x230").at_height(20.0)


def test_every_antenna_has_its_housing_and_a_source():
    papers = ("hf_multireader_mcl", "rssi_kalman_navifloor", "markov_kalman_smart_floor")
    for name, found in antennas().items():
        length, width = HOUSINGS_MM.get(name) or (float(part) for part in name.split("x"))
        assert found.name == name
        assert found.housing_mm == (length, width)
        assert found.outline().bounds == (-length / 2, -width / 2, length / 2, width / 2)
        assert any(paper in found.source for paper in papers) or found.source.startswith("assumption")


def test_no_antenna_sees_beyond_its_housing_but_by_measurement():
    for name, found in antennas().items():
        is_within = found.area.reach_mm <= math.hypot(*found.housing_mm) / 2 + 1e-9
        assert is_within != (name in REACHES_FAR)


# RSSI


def test_the_signal_of_navifloor_reaches_its_steps_within_the_radii_of_table_1():
    found = antenna("navifloor")
    assert found.rssi_radii_mm == (105.0, 100.0, 95.0, 90.0, 80.0, 60.0, 50.0, 40.0)
    assert found.area == Disc(105.0)


def test_only_navifloor_tells_the_strength_of_its_signal():
    assert [name for name, found in antennas().items() if found.rssi_radii_mm] == ["navifloor"]


@pytest.mark.parametrize(
    ("area", "radii", "message"),
    [
        (Disc(50.0), (60.0, 40.0), "rssi_radii_mm begins with 60: must be the radius of the area, a disc"),
        (Rectangle(100.0, 100.0), (50.0, 40.0), "rssi_radii_mm begins with 50: must be the radius of the area"),
        (Disc(50.0), (50.0, 50.0), r"rssi_radii_mm is \[50.0, 50.0\]: must fall from step to step"),
        (Disc(50.0), (50.0, 30.0, 40.0), r"rssi_radii_mm is \[50.0, 30.0, 40.0\]: must fall"),
        (Disc(50.0), (50.0, 0.0), r"rssi_radii_mm is \[50.0, 0.0\]: must .* stay above 0"),
        (Disc(50.0), (50.0, -1.0), "must .* stay above 0"),
        (Disc(50.0), (50.0, math.nan), "must .* stay above 0"),
        (Disc(50.0), (50.0, math.nan, 10.0), "must fall from step to step"),
        (Disc(50.0), (math.nan, 10.0), "rssi_radii_mm begins with nan"),
    ],
)
def test_radii_of_rssi_begin_with_the_area_fall_and_stay_above_0(area, radii, message):
    with pytest.raises(ValueError, match=message):
        Antenna("test", (100.0, 100.0), area, "test", radii)


@pytest.mark.parametrize("radii", [(), (50.0,), (50.0, 49.0, 1.0)])
def test_good_radii_of_rssi_are_taken(radii):
    assert Antenna("test", (100.0, 100.0), Disc(50.0), "test", radii).rssi_radii_mm == radii


def test_an_unknown_antenna_is_answered_with_all_names():
    with pytest.raises(
        ValueError, match=r"antenna is '61x60', must be one of 30x30, .*, 660x300, navifloor, smart-floor"
    ):
        antenna("61x60")
