"""[placements.NAME]: readers that the program places, in a study from its file to its results."""

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.geometry import listed
from rfiddesign.report import write_report
from rfiddesign.report.contents import read_contents
from rfiddesign.report.extras import extras
from rfiddesign.results.folder import read_record
from rfiddesign.results.placements import Placements
from rfiddesign.study import load_study, run_study, verify
from rfiddesign.study.load import design_of, space_of
from rfiddesign.study.pipeline import hash_parts
from rfiddesign.study.placements import place_readers_of

PLACED = """
[placements.placed]
antenna = "60x60"
pitch_mm = 150.0
distance_mm = 500.0
"""


@pytest.fixture
def placed(tiny, edit):
    edit('layout = ["cross-8", "pair"]', 'layout = ["placed", "pair"]')
    edit("[layouts.pair]", f"{PLACED}\n[layouts.pair]")
    return tiny


def test_a_placement_is_a_layout_of_the_space_and_of_the_design_at_hand(placed):
    study = load_study(placed, ("layout=placed", "pitch_mm=150"))
    layout = space_of(study).layouts[0]
    # 150 mm are closed by three swaths of 60 mm.
    assert (layout.name, layout.n_readers) == ("placed", 3)
    assert design_of(study).layout == layout


@pytest.mark.usefixtures("without_pictures")
def test_a_study_says_in_its_results_what_was_placed_and_what_that_promises(placed, tmp_path):
    out = tmp_path / "out"
    stages = []
    result = run_study(load_study(placed), out, 1, stages.append)
    assert any(stage.what == "placing readers" for stage in stages)
    (record,) = read_record(out / "placements.json", Placements).placements
    assert (record.name, record.n_readers, record.lower_bound, record.is_proved) == ("placed", 3, 3, True)
    assert [check.is_guaranteed for check in record.checks] == [True]
    assert any(design.layout == "placed" for design in result.designs)
    page = write_report(out).read_text()
    assert 'id="placements"' in page
    assert "a read within 500 mm, forward" in page
    assert 'id="figure-placement-1"' in page
    assert not any(check.faults for check in verify(out))


def test_reports_of_other_studies_do_not_speak_of_placements(finished):
    assert not (finished / "placements.json").exists()
    assert extras(read_contents(finished)) == ()


def test_where_readers_stand_is_part_of_the_hash(placed, edit, tmp_path):
    parts = hash_parts(load_study(placed))
    edit("distance_mm = 500.0", "distance_mm = 400.0")
    changed = hash_parts(load_study(placed))
    assert parts["study"] != changed["study"]
    edit('layout = ["placed", "pair"]', 'layout = ["pair"]')
    assert "placements" in parts
    assert "placements" not in hash_parts(load_study(placed))


def test_place_readers_gives_a_layout_to_copy(placed, edit):
    study = load_study(placed)
    found = place_readers_of(study.path, study.file)["placed"]
    poses = [(pose["x_mm"], pose["y_mm"]) for pose in found["antennas"]]
    edit("[layouts.pair]", found["toml"] + "\n[layouts.pair]")
    copied = design_of(load_study(placed, ("layout=placed-3",))).layout
    assert copied.poses == listed(poses).poses
    shapes = {rival["shape"]: rival for rival in found["rivals"]}
    # Findings 9: the cross of eight does not alias at 150 mm.
    assert shapes["cross-8"]["is_guaranteed"]
    assert any(name.startswith("bar of 3,") for name in shapes)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("pitch_mm = 150.0", "", "placements.placed"),
        ("pitch_mm = 150.0", "pitch_mm = 150.0\ntags_per_m2 = 9.0", "exactly one"),
        ("pitch_mm = 150.0", 'pitch_mm = 150.0\npattern = "random"', "lattice"),
        ("distance_mm = 500.0", "distance_mm = -1.0", "distance_mm"),
        ("distance_mm = 500.0", "distance_mm = 500.0\ngrid_mm = 1.0", "grid_mm"),
        ("distance_mm = 500.0", 'distance_mm = 500.0\nmotions = ["backward"]', "motions"),
        ("distance_mm = 500.0", "distance_mm = 500.0\nkeep_outs_mm = [[0.0, 0.0]]", "keep_outs_mm"),
        ('[placements.placed]\nantenna = "60x60"', '[placements.placed]\nantenna = "61x61"', "61x61"),
        ("[placements.placed]", "[placements.pair]", "already"),
        ("[placements.placed]", "[placements.other]", "space.layout"),
    ],
)
def test_bad_placements_are_named_when_the_file_is_read(placed, edit, old, new, words):
    edit(old, new)
    with pytest.raises(StudyError, match=words):
        load_study(placed)


def test_a_distance_that_nothing_serves_is_named_when_readers_are_placed(placed, edit):
    edit("pitch_mm = 150.0\ndistance_mm = 500.0", "pitch_mm = 2000.0\ndistance_mm = 50.0")
    with pytest.raises(StudyError, match=r"placements.placed.*distance_mm = 50"):
        space_of(load_study(placed))


def test_settings_name_placements_as_a_whole(placed):
    with pytest.raises(StudyError, match=r"placements.grid_mm.*unknown key"):
        load_study(placed, ("placements.grid_mm=10",))
    changed = "placements={placed = {pitch_mm = 120.0, distance_mm = 500.0}}"
    assert space_of(load_study(placed, (changed,))).layouts[0].n_readers == 2
