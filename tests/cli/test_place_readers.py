"""`rfiddesign place-readers`: what it prints and writes."""

import json
import subprocess
import sys

PLACED = """
[placements.three]
pitch_mm = 150.0
distance_mm = 500.0
[placements.two-alive]
pitch_mm = 100.0
distance_mm = 300.0
is_one_dead = true
"""


def with_placements(tiny):
    study = tiny / "study.toml"
    study.write_text(study.read_text() + PLACED)
    return tiny


def test_it_prints_readers_bound_recheck_and_a_layout(cli, tiny):
    answer = cli("place-readers", with_placements(tiny), "--name", "three")
    assert answer.status == 0, answer.err
    assert "three: 3 readers, 60x60 mm antennas" in answer.out
    assert "fewest, proved: at least 3 (forward: rows 150 mm apart, a swath of 60 mm)" in answer.out
    assert "forward: guaranteed from every phase and heading" in answer.out
    assert '[layouts.placed-3]\nkind = "list"\nposes = [[' in answer.out
    assert "two-alive" not in answer.out


def test_it_prints_one_json_object_and_nothing_else_and_writes_pictures(tiny, tmp_path):
    # In a process of its own: the solver has a banner that Python cannot catch.
    arguments = ["place-readers", str(with_placements(tiny)), "--name", "two-alive", "--json", "--out", "pictures"]
    done = subprocess.run(
        [sys.executable, "-m", "rfiddesign", *arguments], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    found = json.loads(done.stdout)["two-alive"]
    assert found["is_proved"]
    assert len(found["antennas"]) == found["lower_bound"] >= 4
    assert (tmp_path / "pictures" / "placement-1.png").stat().st_size > 10_000
    assert json.loads((tmp_path / "pictures" / "placements.json").read_text())["placements"][0]["name"] == "two-alive"


def test_a_study_without_placements_is_refused_in_one_line(cli, tiny):
    answer = cli("place-readers", tiny)
    assert answer.status == 2
    assert "placements" in answer.err
    assert answer.err.count("\n") == 1


def test_an_unknown_name_is_refused_with_those_there_are(cli, tiny):
    answer = cli("place-readers", with_placements(tiny), "--name", "four")
    assert answer.status == 2
    assert "three, two-alive" in answer.err


def test_the_sparsest_rows_are_a_table_and_an_object(cli, tiny):
    study = tiny / "study.toml"
    study.write_text(study.read_text() + '[layouts.one]\nkind = "single"\n')
    design = ("--set", "layout=one", "--set", "antenna=320x230")
    options = ("--step-mm", "40", "--distance-mm", "800")
    answer = cli("sparsest-pattern", tiny, *design, *options)
    assert answer.status == 0, answer.err
    assert "one, 320x230 mm antennas: a read of 0.05 s within 800 mm at 300 mm/s" in answer.out
    found = json.loads(cli("sparsest-pattern", tiny, *design, *options, "--json").out)
    square = found["patterns"][0]
    # Rows of a square lattice lie no farther apart than the swath of 230 mm.
    assert (square["family"], square["pitch_mm"], square["tags_per_m2"]) == ("square", 200.0, 25.0)
    assert f"{'square':12}{200:10d}{200:10d}{0:10d}{25:10d}" in answer.out


def test_a_robot_too_fast_for_its_readers_is_refused_in_one_line(cli, tiny):
    answer = cli("sparsest-pattern", tiny, "--set", "layout=pair", "--read-time-s", "5")
    assert answer.status == 2
    assert "driven during a read" in answer.err
    assert answer.err.count("\n") == 1
