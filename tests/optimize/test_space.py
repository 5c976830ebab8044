"""The space of designs: all combinations, numbered, and what of it can be built."""

import pytest
import shapely

from rfiddesign.catalog import antenna
from rfiddesign.design import Design, check_design
from rfiddesign.geometry import make_layout, make_pattern
from rfiddesign.optimize import Space, unbuildable

LAYOUTS = tuple(make_layout(spec) for spec in ("cross-8", {"kind": "bar", "n": 2, "spacing_mm": 70.0}))
ANTENNAS = tuple(antenna(name) for name in ("60x60", "80x80", "660x300"))
PATTERNS = tuple(make_pattern("square", tags_per_m2=density) for density in (16, 100))
SPACE = Space(LAYOUTS, ANTENNAS, PATTERNS)
ROBOT = shapely.Point(0, 0).buffer(300.0, quad_segs=256)


def test_a_design_s_number_is_its_place_with_the_pattern_counting_fastest():
    designs = SPACE.designs()
    assert len(designs) == SPACE.size == 12
    assert len(set(designs)) == 12
    for number, design in enumerate(designs):
        layout, rest = divmod(number, 6)
        assert design == Design(LAYOUTS[layout], ANTENNAS[rest // 2], PATTERNS[rest % 2])


@pytest.mark.parametrize("values", [((), ANTENNAS, PATTERNS), (LAYOUTS, (), PATTERNS), (LAYOUTS, ANTENNAS, ())])
def test_an_empty_variable_makes_an_empty_space(values):
    with pytest.raises(ValueError, match="space is empty, every variable needs at least one value"):
        Space(*values)


def test_more_than_a_million_designs_are_refused_before_they_are_listed():
    Space(LAYOUTS[:1] * 1000, ANTENNAS[:1] * 100, PATTERNS[:1] * 10)
    with pytest.raises(ValueError, match=r"space has 1,001,000 designs, at most 1,000,000 are allowed"):
        Space(LAYOUTS[:1] * 1001, ANTENNAS[:1] * 100, PATTERNS[:1] * 10)


def test_what_cannot_be_built_is_told_once_per_layout_and_antenna_with_the_check_s_own_words():
    found = {(pair.layout_name, pair.antenna_name): pair.reason for pair in unbuildable(SPACE, ROBOT)}
    assert set(found) == {("cross-8", "660x300"), ("bar-2", "80x80"), ("bar-2", "660x300")}
    for design in SPACE.designs():
        pair = (design.layout.name, design.antenna.name)
        if pair in found:
            with pytest.raises(ValueError, match=r"overlap|stick") as caught:
                check_design(design, ROBOT)
            assert str(caught.value) == found[pair]
        else:
            check_design(design, ROBOT)
