"""The antennas that a study may name."""

import math

import pytest

from rfiddesign.catalog import antenna, antennas


@pytest.mark.parametrize(
    ("name", "area_mm2"),
    [
        # hf_multireader_mcl, eq. 5: sqrt(15^2 - (20 - 8)^2) = 9; the others hang at the height of their centre.
        ("30x30", math.pi * 9.0**2),
        ("60x60", math.pi * 30.0**2),
        ("80x80", math.pi * 40.0**2),
        ("320x230", 320.0 * 230.0),
        ("660x300", 660.0 * 300.0),
    ],
)
def test_what_an_antenna_sees_of_the_floor(name, area_mm2):
    assert antenna(name).area.area_mm2 == pytest.approx(area_mm2, rel=1e-12)


def test_every_antenna_has_its_housing_and_a_source():
    for name, found in antennas().items():
        length, width = (float(part) for part in name.split("x"))
        assert found.name == name
        assert found.housing_mm == (length, width)
        assert found.outline().bounds == (-length / 2, -width / 2, length / 2, width / 2)
        assert "hf_multireader_mcl" in found.source or found.source.startswith("assumption")


def test_no_antenna_sees_beyond_its_housing_but_by_chance_of_its_source():
    for found in antennas().values():
        assert found.area.reach_mm <= math.hypot(*found.housing_mm) / 2 + 1e-9


def test_an_unknown_antenna_is_answered_with_all_names():
    with pytest.raises(ValueError, match=r"antenna is '61x60', must be one of 30x30, 60x60, 80x80, 320x230, 660x300"):
        antenna("61x60")
