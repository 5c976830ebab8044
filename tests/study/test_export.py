"""Exporting the filter of a study's design: what is written, and what is refused."""

import shutil
import subprocess

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.study import export_estimator, load_study, variant_of


def exported(folder, out, *settings):
    return export_estimator(load_study(folder, settings), out)


def test_the_filter_of_the_design_at_hand_is_written(tiny, tmp_path):
    """8 antennas; a square lattice of 16 tags/m2 over 6 m x 5 m."""
    found = exported(tiny, tmp_path, "layout=cross-8", "tags_per_m2=16")
    assert found["file"] == str(tmp_path / "rfid_pmg.c")
    assert (found["estimator"], found["n_antennas"], found["n_tags"]) == ("pmg", 8, 480)
    text = (tmp_path / "rfid_pmg.c").read_text()
    assert "tiny-study: A tiny hall" in text
    assert "cross-8, " in text
    assert "pmg_init_unknown(&state, 300, 300, 5700, 4700)" in text


def test_the_study_may_name_any_filter_and_its_pmg_section_counts(tiny, tmp_path):
    """Also where the choice is left open."""
    texts = []
    for i, estimator in enumerate(("mcl", "pmg", "quantized_ekf", "auto")):
        exported(tiny, tmp_path / f"{i}.c", f"estimator={estimator}", "pmg.n_components=3")
        texts.append((tmp_path / f"{i}.c").read_text())
    assert texts == [texts[0]] * 4
    assert "#define PMG_N_COMPONENTS 3 " in texts[0]


def test_what_the_world_is_told_to_be_is_what_the_filter_believes(tiny, tmp_path):
    """As in a simulation: softness from the installation error (and 1 mm), a delay only where it is known."""
    settings = ("world.installation_error_mm=10.0", "world.delay_s=0.1", "world.is_delay_known=true")
    exported(tiny, tmp_path, *settings)
    text = (tmp_path / "rfid_pmg.c").read_text()
    assert "#define PMG_SOFTNESS 10.04987562" in text
    assert "#define PMG_DELAY_STEPS 2.0 " in text


def test_a_variant_is_exported_by_name(tiny, edit, tmp_path):
    edit("[floor]", '[[variants]]\nname = "few"\nset = { "pmg.n_components" = 2 }\n[floor]')
    export_estimator(variant_of(load_study(tiny), "few", "--variant"), tmp_path)
    assert "#define PMG_N_COMPONENTS 2 " in (tmp_path / "rfid_pmg.c").read_text()


def test_the_same_study_gives_the_same_bytes(tiny, tmp_path):
    for name in ("a.c", "b.c"):
        exported(tiny, tmp_path / name)
    assert (tmp_path / "a.c").read_bytes() == (tmp_path / "b.c").read_bytes()


def test_a_floor_of_too_many_tags_is_refused_and_nothing_is_written(tiny, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    with pytest.raises(
        StudyError, match=r"study.toml: design: the map of [\d,]+ tags and the field would take [\d,]+ bytes"
    ):
        exported(tiny, out, "floor.rectangle_m=[100.0, 80.0]", "tags_per_m2=100")
    assert list(out.iterdir()) == []
    found = exported(tiny, out, "floor.rectangle_m=[100.0, 80.0]", "tags_per_m2=100", "pmg.learns_from_nothing=false")
    assert (found["n_tags"], found["table_bytes"]) == (0, 0)


def test_a_folder_that_is_not_there_is_refused(tiny, tmp_path):
    with pytest.raises(StudyError, match=r"nowhere: is no folder to write to"):
        exported(tiny, tmp_path / "nowhere" / "x.c")


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
def test_what_is_written_compiles_without_a_warning(tiny, tmp_path):
    exported(tiny, tmp_path, "pattern=random")
    command = ["gcc", "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wdouble-promotion", "-Werror", "-O2", "-c"]
    subprocess.run([*command, "rfid_pmg.c"], cwd=tmp_path, check=True)
