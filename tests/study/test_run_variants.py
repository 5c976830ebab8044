"""Variants run in folders of their own: the answers of the variants alone, whatever happens on the way."""

import json

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.results.comparison import Comparison
from rfiddesign.results.study_result import StudyResult
from rfiddesign.study import load_study, run_study, run_variants

VARIANTS = """
[[variants]]
name = "mcl"
condition = "matched"
[[variants]]
name = "ekf"
condition = "matched"
set = { estimator = "quantized_ekf", "world.installation_error_mm" = 4.0 }
[[variants]]
name = "odometry"
condition = "matched"
set = { estimator = "odometry", "fleet.robots" = [1] }
"""


@pytest.fixture
def several(tiny, edit):
    """The tiny study with three variants and a smaller space."""
    edit('["square", "random"]', '["random"]')
    (tiny / "study.toml").write_text((tiny / "study.toml").read_text() + VARIANTS)
    return tiny


def run(folder, out, on_stage=lambda stage: None, settings=()) -> Comparison:
    return run_variants(load_study(folder, settings), out, 2, on_stage)


def files(out) -> dict:
    return {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}


def test_answers_are_those_of_the_variants_alone_and_savings_their_differences(several, tmp_path):
    out, said = tmp_path / "out", []
    comparison = run(several, out, lambda stage: said.append(stage.what))
    assert comparison == Comparison.model_validate_json((out / "comparison.json").read_bytes())
    assert [variant.folder for variant in comparison.variants] == ["mcl", "ekf", "odometry"]
    assert (comparison.base, comparison.fleets) == ("mcl", [1, 40])
    settings = ("estimator=quantized_ekf", "installation_error_mm=4.0")
    alone = run_study(load_study(several, settings), tmp_path / "alone", 1, lambda stage: None)
    found = StudyResult.model_validate_json((out / "ekf" / "result.json").read_bytes())
    assert (found.answers, found.designs, found.assumptions) == (alone.answers, alone.designs, alone.assumptions)
    mcl, ekf, odometry = comparison.variants
    for own, base, answer in zip(ekf.answers, mcl.answers, alone.answers, strict=True):
        assert own.winner.cost_cents == answer.winner.cost_cents
        assert own.saving.cents == base.winner.cost_cents - own.winner.cost_cents
        assert base.saving is None
    assert odometry.answers[0].claim == "none holds"
    assert odometry.answers[0].saving is odometry.answer(40) is None
    assert "variant 2 of 3: ekf: reading the floor" in said
    # Once more, every answer is read and nothing is simulated or written anew but the comparison.
    before, said[:] = files(out), []
    assert run(several, out, lambda stage: said.append(stage.what)) == comparison
    assert files(out) == before
    assert [what for what in said if "answered before" in what] == [
        f"variant {i} of 3: {name}: answered before" for i, name in ((1, "mcl"), (2, "ekf"), (3, "odometry"))
    ]


def test_an_interrupted_comparison_goes_on_and_one_more_variant_is_added(several, tmp_path):
    out = tmp_path / "out"

    def interrupt(stage) -> None:
        if stage.what.startswith("variant 2 of 3") and stage.n_runs > 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(several, out, interrupt)
    assert not (out / "comparison.json").exists()
    assert (out / "mcl" / "result.json").exists()
    assert not (out / "ekf" / "result.json").exists()
    first = (out / "mcl" / "provenance.json").read_bytes()
    with (several / "study.toml").open("a") as stream:
        stream.write('[[variants]]\nname = "held"\nset = { estimator = "odometry", "fleet.robots" = [2] }\n')
    comparison = run(several, out)
    assert [variant.name for variant in comparison.variants] == ["mcl", "ekf", "odometry", "held"]
    assert (out / "mcl" / "provenance.json").read_bytes() == first
    assert json.loads((out / "ekf" / "provenance.json").read_text())["runs_stored_before"] > 0
    whole = run(several, tmp_path / "whole")
    assert whole == comparison


def test_a_folder_of_another_study_is_refused_and_left_alone(several, finished, tmp_path):
    with pytest.raises(StudyError, match="holds another study, or this one before a change; choose another --out"):
        run(several, finished)
    out = tmp_path / "out"
    run(several, out, settings=("estimator=odometry", "fleet.robots=[1]", "max_runs=10"))
    before = files(out)
    with pytest.raises(StudyError, match="out: holds another study"):
        run(several, out)
    text = (several / "study.toml").read_text()
    with pytest.raises(StudyError, match="out: holds another study"):
        run_study(load_study(several), out, 1, lambda stage: None)
    (several / "study.toml").write_text(text.replace('installation_error_mm" = 4.0', 'installation_error_mm" = 3.0'))
    with pytest.raises(StudyError, match="out/ekf: variant 'ekf': holds another study"):
        run(several, out, settings=("estimator=odometry", "fleet.robots=[1]", "max_runs=10"))
    assert files(out) == before


def test_nothing_is_simulated_before_every_variant_is_checked(several, tmp_path):
    with (several / "study.toml").open("a") as stream:
        stream.write('[[variants]]\nname = "last"\nset = { footprint_radius_mm = 100.0 }\n')
    with pytest.raises(StudyError, match=r"study.toml: variant 'last': space: no design can be built: "):
        run(several, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_savings_are_against_the_group_that_the_study_names(several, tmp_path):
    (several / "study.toml").write_text((several / "study.toml").read_text() + '[comparison]\nbase = "odometry"\n')
    comparison = run(several, tmp_path / "out", settings=("space.tags_per_m2=[225.0]", 'space.layout=["pair"]'))
    assert comparison.base == "odometry"
    assert [answer.saving for variant in comparison.variants for answer in variant.answers] == [None] * 5
