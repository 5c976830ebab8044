"""Variants on the command line: run compares them, check lists them, evaluate and coverage take one."""

import json
from pathlib import Path

import pytest

from rfiddesign.results.comparison import Comparison

VARIANTS = """
[[variants]]
name = "mcl"
[[variants]]
name = "dead <b>"
set = { estimator = "odometry", "design.layout" = "pair" }
"""


@pytest.fixture
def several(tiny, edit):
    """The tiny study for one robot with two variants."""
    edit("[1, 40]", "[1]")
    edit('["square", "random"]', '["random"]')
    (tiny / "study.toml").write_text((tiny / "study.toml").read_text() + VARIANTS)
    return tiny


@pytest.mark.usefixtures("without_pictures")
def test_run_compares_and_report_draws_the_comparison_again(cli, several, tmp_path):
    out = tmp_path / "out"
    answer = cli("run", several, "--out", out, "--workers", "2", "--json")
    assert answer.status == 0, answer.err
    found = json.loads(answer.out)
    assert found.pop("report") == str(out / "report.html")
    comparison = Comparison.model_validate_json((out / "comparison.json").read_bytes())
    assert Comparison.model_validate(found) == comparison
    assert all((out / name / "report.html").exists() for name in ("mcl", "dead-b"))
    assert "A tiny hall (dead &lt;b&gt;)" in (out / "dead-b" / "report.html").read_text()
    page, table = (out / "report.html").read_bytes(), (out / "comparison.csv").read_bytes()
    (out / "report.html").unlink()
    own = (out / "mcl" / "report.html").stat().st_mtime_ns
    assert cli("report", out).out == f"{out / 'report.html'}\n"
    assert ((out / "report.html").read_bytes(), (out / "comparison.csv").read_bytes()) == (page, table)
    # Run again, everything is there already, and people get text.
    text = cli("run", several, "--out", out).out
    assert (out / "mcl" / "report.html").stat().st_mtime_ns == own
    assert "2 variants; savings are against mcl" in text
    assert [line.split()[0] for line in text.splitlines() if line.startswith("  ")] == ["mcl", "dead"]
    assert comparison.variants[0].answers[0].winner.name in text
    assert "none certified: every design was refuted" in text
    assert f"report: {out / 'report.html'}" in text


def test_an_interrupted_comparison_says_how_to_go_on(cli, several, tmp_path, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("rfiddesign.study.run_variants", interrupt)
    answer = cli("run", several, "--out", tmp_path / "out")
    assert answer.status == 130
    assert answer.err == f"interrupted; what was done is in {tmp_path / 'out'}: the same command goes on from there\n"


def test_check_lists_the_variants(cli, several, tiny):
    found = json.loads(cli("check", several, "--json").out)
    assert [variant["name"] for variant in found["variants"]] == ["mcl", "dead <b>"]
    assert found["variants"][1]["set"] == {"estimator": '"odometry"', "design.layout": '"pair"'}
    text = cli("check", several).out
    assert "variant mcl: as the study itself\n" in text
    assert 'variant dead <b>: estimator = "odometry", design.layout = "pair"\n' in text


def test_evaluate_and_coverage_take_the_study_or_a_variant(cli, several):
    for command in (("evaluate", several, "--runs", "2"), ("coverage", several)):
        base = json.loads(cli(*command, "--json").out)
        variant = json.loads(cli(*command, "--variant", "dead <b>", "--json").out)
        assert base["design"].startswith("cross-8, ")
        assert variant["design"].startswith("pair, ")
    assert json.loads(cli("evaluate", several, "--runs", "1", "--variant", "dead <b>", "--json").out)["estimator"] == (
        "odometry"
    )


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("evaluate", "--variant", "elf"), "rfiddesign: --variant: found 'elf'; must be one of mcl, dead <b>\n"),
        (("coverage", "--variant", "mlc"), "rfiddesign: --variant: found 'mlc'; did you mean 'mcl'? must be one of"),
        (("run", "--set", "variants=[]"), "rfiddesign: --set: variants: unknown key; allowed: "),
        (("run", "--set", "space.layout=['pear']"), "rfiddesign: "),
    ],
)
def test_what_makes_no_sense_is_one_line(cli, several, arguments, line):
    command, *options = arguments
    answer = cli(command, several, *options)
    assert (answer.status, answer.out) == (2, "")
    assert answer.err.startswith(line)
    assert answer.err.count("\n") == 1
    assert list(Path.cwd().iterdir()) == []


def test_an_unfinished_comparison_has_no_report_yet(cli, several, tmp_path):
    (tmp_path / "out").mkdir()
    assert "result.json: cannot be read: No such file" in cli("report", tmp_path / "out").err
