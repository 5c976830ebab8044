"""The readers that a study may name."""

import pytest

from rfiddesign.catalog import USUAL_READER, antenna, reader, readers
from rfiddesign.design import Design
from rfiddesign.geometry import make_layout, make_pattern


def test_every_reader_has_its_name_and_a_source():
    for name, found in readers().items():
        assert found.name == name
        assert isinstance(found.sees_one_tag_only, bool)
        assert found.source
        assert reader(name) is found


def test_there_are_readers_with_anti_collision_and_without():
    assert {found.sees_one_tag_only for found in readers().values()} == {True, False}
    assert reader("goetting-hg-g-98830").sees_one_tag_only


def test_a_design_has_a_reader_with_anti_collision_unless_it_says_otherwise():
    assert not reader(USUAL_READER).sees_one_tag_only
    design = Design(make_layout("cross-8"), antenna("60x60"), make_pattern("square", tags_per_m2=100.0))
    assert design.reader == reader(USUAL_READER)


def test_an_unknown_reader_is_answered_with_all_names():
    with pytest.raises(ValueError, match=r"reader is 'goetting', must be one of hf-anticollision, goetting-hg-g-98830"):
        reader("goetting")
