"""What an answer depends on, and what is left of a space to be tested."""

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.simulation.monte_carlo import Simulator
from rfiddesign.study import load_study
from rfiddesign.study.candidates import find_candidates
from rfiddesign.study.load import floor_of, scenario_of, space_of
from rfiddesign.study.pipeline import price_candidates, study_hash


def candidates_of(study):
    floor = floor_of(study)
    with Simulator(scenario_of(study, floor), study.file.seed, 2) as simulator:
        return find_candidates(study, floor, simulator, lambda stage: None)


def test_the_hash_is_that_of_the_question_not_of_its_wording(tiny, edit):
    before = study_hash(load_study(tiny))
    edit("# A study that ends in a second: see conftest.py.", "# Another comment.")
    (tiny / "README.md").write_text("notes")
    assert study_hash(load_study(tiny)) == before


@pytest.mark.parametrize(
    ("old", "new", "file"),
    [
        ("seed = 7", "seed = 8", "study.toml"),
        ("n_particles = 60", "n_particles = 61", "study.toml"),
        ("price = 42.00", "price = 42.01", "prices.toml"),
        ('source = "offer"', 'source = "another offer"', "prices.toml"),
        ("seed = 7", 'seed = 7\nestimator = "quantized_ekf"', "study.toml"),
        ("[robot]", '[robot]\nreader = "goetting-hg-g-98830"', "study.toml"),
        ("[mcl]", "[world]\ndelay_s = 0.05\n[mcl]", "study.toml"),
    ],
)
def test_the_hash_changes_with_every_part_of_the_question(tiny, edit, old, new, file):
    before = study_hash(load_study(tiny))
    edit(old, new, file=file)
    assert study_hash(load_study(tiny)) != before


def test_the_hash_changes_with_the_map_and_not_with_what_lies_beside_it(tiny, grey_map):
    grey_map(254)
    before = study_hash(load_study(tiny))
    (tiny / "floor" / "ORIGIN.md").write_text("from the architect")
    assert study_hash(load_study(tiny)) == before
    image = tiny / "floor" / "hall.pgm"
    image.write_text(image.read_text().replace(" 254 0\n", " 0 0\n", 1))
    assert study_hash(load_study(tiny)) != before


def test_a_map_that_is_not_there_is_one_line(tiny, edit):
    edit("rectangle_m = [6.0, 5.0]", 'map = "no/map.yaml"')
    with pytest.raises(StudyError, match=r"no/map.yaml: cannot be read: No such file or directory"):
        study_hash(load_study(tiny))


def test_candidates_are_what_can_be_built_and_passes_the_screen(tiny):
    study = load_study(tiny, ("min_expected_reads=0.3", "layouts={pair = {kind = 'bar', n = 2, spacing_mm = 70.0}}"))
    found = candidates_of(study)
    assert [(pair.layout_name, pair.antenna_name) for pair in found.unbuildable] == [("pair", "80x80")]
    assert found.n_unbuildable == 6
    assert found.n_combinations == 24
    (screen,) = found.screens
    assert 0 < screen.n_removed == 24 - 6 - len(found.numbers)
    designs = space_of(study).designs()
    for number in found.numbers:
        design = found.by_number[number].design
        assert design == designs[number]
        assert (design.layout.name, design.antenna.name) != ("pair", "80x80")
        assert found.by_number[number].n_tags == len(design.pattern.lay(floor_of(study).drivable))


def test_a_reader_that_must_see_one_tag_leaves_sparse_patterns_to_be_tested(tiny):
    found = candidates_of(load_study(tiny, ("reader=goetting-hg-g-98830",)))
    designs = [candidate.design for candidate in found.by_number.values()]
    left = {(design.antenna.name, design.pattern.tags_per_m2) for design in designs}
    assert ("80x80", 225.0) not in left
    assert ("60x60", 64.0) in left
    assert {fault.layout_name for fault in found.unbuildable} == {"any layout"}
    assert found.n_unbuildable + len(found.numbers) == 24
    with pytest.raises(
        StudyError, match=r"space: no design can be built: reader goetting-hg-g-98830 must never see two"
    ):
        candidates_of(load_study(tiny, ("reader=goetting-hg-g-98830", "space.tags_per_m2=[900.0]")))


def test_every_candidate_is_priced_and_more_robots_never_cost_less(tiny):
    study = load_study(tiny)
    found = candidates_of(study)
    few, many = (price_candidates(study, found, n) for n in (1, 40))
    assert set(few) == set(many) == set(found.numbers)
    assert all(few[number].total_cents < many[number].total_cents for number in few)


def test_a_price_that_no_ledger_holds_is_one_line(tiny, edit):
    edit("reader = { price = 42.00", "reader = { price = 1e9", file="prices.toml")
    study = load_study(tiny)
    found = candidates_of(study)
    price_candidates(study, found, 1000)
    with pytest.raises(StudyError, match=r"prices.toml: .* would cost .* cents, at most 1e\+18"):
        price_candidates(study, found, 100_000_000)


@pytest.mark.parametrize(
    ("setting", "line"),
    [
        ("min_expected_reads=1000", "search.min_expected_reads: every design has fewer than 1000 expected reads"),
        ("space.layout=['pair', 'pair']", r"space.layout: found \['pair', 'pair'\], must not name a value twice"),
        ("space.tags_per_m2=[4, 4.0]", r"space.tags_per_m2: found \[4.0, 4.0\], must not name a value twice"),
        ("layouts={pair = {kind = 'bar', n = 2, spacing_mm = 600.0}}", None),
        ("footprint_radius_mm=100", "space: no design can be built: layout cross-8: antenna 1 .* sticks out"),
    ],
)
def test_a_space_that_leaves_nothing_to_test_is_one_line(tiny, setting, line):
    study = load_study(tiny, (setting,))
    if line is None:
        assert {candidate.design.layout.name for candidate in candidates_of(study).by_number.values()} == {"cross-8"}
        return
    with pytest.raises(StudyError, match=line):
        candidates_of(study)
