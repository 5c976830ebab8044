"""The space of designs: all combinations, numbered, and what of it can be built."""

import pytest
import shapely

from rfiddesign.catalog import antenna, reader
from rfiddesign.design import Design, check_design, check_tag_spacing
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


ONE_TAG = Space(LAYOUTS, ANTENNAS, (*PATTERNS, make_pattern("square", tags_per_m2=400)), reader("goetting-hg-g-98830"))


def test_every_design_of_a_space_has_its_reader():
    assert {design.reader.name for design in ONE_TAG.designs()} == {"goetting-hg-g-98830"}
    assert {design.reader.name for design in SPACE.designs()} == {"hf-anticollision"}


def test_a_reader_that_must_see_one_tag_rules_out_what_is_dense_for_its_antenna_whatever_the_layout():
    """60 mm take 100 tags/m2 (100 mm apart) and not 400; 600 mm take nothing; 80 mm do not take 400."""
    dense = [pair for pair in unbuildable(ONE_TAG, ROBOT) if pair.layout_name == "any layout"]
    assert [(pair.antenna_name, pair.reason.split("with ")[-1].split(" lie")[0]) for pair in dense] == [
        ("60x60", "400 tags/m2"),
        ("80x80", "400 tags/m2"),
        ("660x300", "16 tags/m2"),
        ("660x300", "100 tags/m2"),
        ("660x300", "400 tags/m2"),
    ]
    assert all("goetting-hg-g-98830 must never see two tags at once" in pair.reason for pair in dense)
    assert "lie 50 mm apart" in dense[0].reason


def test_every_design_that_cannot_be_built_is_counted_once_with_the_first_fault():
    found = unbuildable(ONE_TAG, ROBOT)
    numbers = [number for pair in found for number in pair.numbers]
    assert len(numbers) == len(set(numbers))
    ruled_out = set(numbers)
    for number, design in enumerate(ONE_TAG.designs()):
        try:
            check_design(design, ROBOT)
            check_tag_spacing(design)
        except ValueError:
            assert number in ruled_out
        else:
            assert number not in ruled_out
    # Layouts that do not take the antenna come first and leave nothing for the pattern to rule out.
    assert all(not pair.numbers for pair in found if (pair.layout_name, pair.antenna_name) == ("any layout", "660x300"))


def test_readers_with_anticollision_take_any_density():
    pairs = unbuildable(Space(LAYOUTS, ANTENNAS, ONE_TAG.patterns), ROBOT)
    assert "any layout" not in {pair.layout_name for pair in pairs}


# Designs with one of several estimators

OPEN = Space(LAYOUTS, ANTENNAS, PATTERNS, estimators=("particle_filter", "mcl", "quantized_ekf"))


def test_a_candidate_s_number_is_its_place_with_the_estimator_counting_fastest():
    candidates = OPEN.candidates()
    assert len(candidates) == OPEN.size == 36
    for number, (design, estimator) in enumerate(candidates):
        assert design == OPEN.designs()[number // 3]
        assert estimator == OPEN.estimators[number % 3]


def test_with_one_estimator_numbers_are_those_of_the_designs():
    assert [design for design, _ in SPACE.candidates()] == list(SPACE.designs())
    assert OPEN.designs() == SPACE.designs()


def test_what_cannot_be_built_cannot_with_any_estimator():
    for one, several in zip(unbuildable(SPACE, ROBOT), unbuildable(OPEN, ROBOT), strict=True):
        assert (several.layout_name, several.antenna_name, several.reason) == (
            one.layout_name, one.antenna_name, one.reason,
        )  # fmt: skip
        assert several.numbers == {3 * number + i for number in one.numbers for i in range(3)}


def test_estimators_count_towards_the_largest_space():
    with pytest.raises(ValueError, match=r"space has 2,000,000 designs, at most 1,000,000 are allowed"):
        Space(LAYOUTS[:1] * 1000, ANTENNAS[:1] * 100, PATTERNS[:1] * 10, estimators=("mcl", "markov"))
    with pytest.raises(ValueError, match="space is empty"):
        Space(LAYOUTS, ANTENNAS, PATTERNS, estimators=())
