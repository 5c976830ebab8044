"""rfiddesign reproduce: a published system by its name, its rows on paper and as files."""

import json
from pathlib import Path

import pytest

KEYS = ["table", "row", "metric", "published", "measured", "stderr", "unit"]
SMALL = """
title = "A tiny published system"
source = "nobody: nothing"
quick_runs = 2
[base]
tags_per_m2 = 100.0
duration_s = 1.0
[base.route]
kind = "random"
[[rows]]
table = "table 1"
row = "MCL"
metrics = ["x_mm", "theta_rad"]
"""


@pytest.fixture
def small(cli) -> Path:
    """A reproduction in studies/ of the working folder, with a claim that fails."""
    folder = Path("studies/small")
    folder.mkdir(parents=True)
    (folder / "study.toml").write_text(SMALL)
    (folder / "expected.toml").write_text(
        '[published."table 1".MCL]\nx_mm = 1.5\n'
        '[[claims]]\ntable = "table 1"\nrow = "MCL"\nmetric = "x_mm"\nat_most = 0.0\n'
        '[[claims]]\ntable = "table 1"\nrow = "MCL"\nmetric = "x_mm"\nat_least = 0.0\nat_most = 500.0\n'
    )
    return folder


def test_json_is_one_object_and_rows_and_figures_are_written(cli):
    answer = cli("reproduce", "markov-smart-floor", "--quick", "--workers", "2", "--out", "out", "--json")
    assert answer.status == 0, answer.err
    found = json.loads(answer.out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    assert list(found) == ["study", "title", "is_quick", "rows", "claims", "folder"]
    assert (found["study"], found["is_quick"], found["folder"]) == ("markov-smart-floor", True, "out")
    assert found["rows"]
    assert all(list(row) == KEYS for row in found["rows"])
    written = {path.name for path in Path("out").iterdir()}
    assert written == {
        "rows.json", "rows.csv", "figure-5.png", "figure-5.svg", "chance-of-a-read.png", "chance-of-a-read.svg",
    }  # fmt: skip
    assert all((Path("out") / name).stat().st_size > 0 for name in written)
    saved = json.loads(Path("out/rows.json").read_text())
    assert saved == {key: value for key, value in found.items() if key != "folder"}
    assert Path("out/rows.csv").read_text().splitlines()[0].split(",") == KEYS
    assert len(Path("out/rows.csv").read_text().splitlines()) == 1 + len(saved["rows"])


def test_people_get_tables_claims_and_the_folder(cli, small):
    answer = cli("reproduce", "small", "--quick")
    assert answer.status == 0, answer.err
    lines = answer.out.splitlines()
    assert lines[0] == "A tiny published system"
    assert lines[2].split() == ["table", "1", "published", "measured", "+-", "unit"]
    assert lines[3].split()[:3] == ["MCL,", "x_mm", "1.5"]
    assert lines[3].endswith(" mm")
    assert lines[4].split()[:2] == ["MCL,", "theta_rad"]
    assert any(line.startswith("  FAILS  table 1, MCL, x_mm: ") and line.endswith(", at most 0") for line in lines)
    assert any(line.startswith("  holds  ") and line.endswith(", at least 0 and at most 500") for line in lines)
    assert "--quick: few runs; claims are made of the full counts" in lines
    assert lines[-1] == "rows and figures: results/small"
    assert Path("results/small/rows.json").is_file()


def test_the_same_numbers_with_any_number_of_workers_and_from_any_folder(cli, small):
    answers = [
        json.loads(cli("reproduce", name, "--quick", "--workers", str(workers), "--out", "out", "--json").out)
        for name, workers in (("small", 1), ("small", 2), (str(small.absolute()), 2))
    ]
    assert answers[0] == answers[1] == answers[2]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["smal"], "reproduce: found neither smal/study.toml nor studies/smal/study.toml; known: estimator-"),
        (["small", "--workers", "0"], "--workers: found 0, must be from 1 to 1,024"),
        (["small", "--quik"], "Unknown option: --quik"),
        (["studies"], "found neither studies/study.toml nor studies/studies/study.toml"),
        (["x" * 5000], "File name too long"),
        (["small", "--quick", "--out", "file/below"], "file/below: "),
        ([], "parameter --name requires an argument"),
    ],
)
def test_bad_input_is_one_line_and_status_2(cli, small, arguments, words):
    Path("file").write_text("mine")
    answer = cli("reproduce", *arguments)
    assert (answer.status, answer.out) == (2, "")
    assert answer.err.startswith("rfiddesign: ")
    assert answer.err.count("\n") == 1
    assert words in answer.err


def test_a_faulty_row_is_named_with_its_file(cli, small):
    path = small / "study.toml"
    path.write_text(SMALL.replace('"x_mm", ', '"x_m", '))
    answer = cli("reproduce", "small", "--quick")
    assert answer.err.startswith(
        "rfiddesign: studies/small/study.toml: rows (table 1, MCL).metrics: found 'x_m', must be"
    )
    path.write_text(SMALL + 'set = { layout = "cross-9" }\n')
    answer = cli("reproduce", "small", "--quick")
    assert answer.err.startswith(
        "rfiddesign: studies/small/study.toml: rows (table 1, MCL): layout is 'cross-9', must be"
    )
    assert answer.err.count("\n") == 1
    assert not Path("results").exists()


def test_a_study_to_be_searched_is_no_reproduction(cli, tiny):
    answer = cli("reproduce", tiny)
    assert answer.status == 2
    assert answer.err.endswith("study.toml: is no reproduction (it has no rows); use `rfiddesign run`\n")
