"""`export-estimator` on the command line."""

import json
from pathlib import Path


def test_it_writes_into_the_current_folder_and_tells_people_what(cli, tiny):
    answer = cli("export-estimator", tiny, "--set", "layout=cross-8")
    assert answer.status == 0
    assert "pmg with 8 antennas and " in answer.out
    assert "written: rfid_pmg.c" in answer.out
    assert Path("rfid_pmg.c").read_text().startswith("/*\n * rfid_pmg.c: where a robot is")


def test_json_is_one_object(cli, tiny):
    found = json.loads(cli("export-estimator", tiny, "--out", "mine.c", "--json").out)
    assert set(found) == {"file", "estimator", "design", "n_antennas", "n_tags", "table_bytes", "state_bytes"}
    assert Path(found["file"]).name == "mine.c"
    assert Path("mine.c").exists()


def test_bad_input_is_one_line(cli, tiny):
    for arguments, words in (
        (("--variant", "x"), "--variant: found 'x', but the study has no variants"),
        (("--set", "pmg.n_components=65"), "study.toml: pmg.n_components: found 65; input should be less"),
        (("--out", "no/x.c"), "no: is no folder to write to"),
        (("--language", "rust"), "--language"),
    ):
        answer = cli("export-estimator", tiny, *arguments)
        assert (answer.status, answer.out) == (2, "")
        assert answer.err.startswith("rfiddesign: ")
        assert answer.err.count("\n") == 1
        assert words in answer.err
    assert list(Path.cwd().iterdir()) == []
