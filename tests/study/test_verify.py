"""A folder is verified as it was left, and fails with the reason by name once anything in it was altered."""

import json
import shutil
import sqlite3
from pathlib import Path

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.study import load_study, rerun, run_study, verify

TINY = Path(__file__).parents[1] / "tiny-study"


@pytest.fixture
def folder(finished, tmp_path):
    return shutil.copytree(finished, tmp_path / "out")


def faults(folder):
    return [fault for check in verify(folder) for fault in check.faults]


def alter(path, change):
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))


def test_an_untouched_folder_is_verified(folder):
    checks = verify(folder)
    assert all(check.n_looked_at > 0 for check in checks)
    assert faults(folder) == []


def set_in(*keys, to):
    def change(data):
        for key in keys[:-1]:
            data = data[key]
        assert data[keys[-1]] != to(data[keys[-1]])
        data[keys[-1]] = to(data[keys[-1]])

    return change


def one_more(value):
    return value + 1


@pytest.mark.parametrize(
    ("file", "change", "reason"),
    [
        ("certificate.json", set_in("answers", 0, "decisions", 0, "n_passed", to=one_more), "its runs say"),
        ("certificate.json", set_in("answers", 0, "cost_cents", 3, to=one_more), "the price list says"),
        ("certificate.json", set_in("prices", "tag", "amount", to=lambda _: "0.29"), "prices is not what was"),
        ("certificate.json", set_in("candidates", 3, "n_tags", to=one_more), "the price list says"),
        ("certificate.json", set_in("boundaries", 0, "certify_at", 9, to=one_more), "does not follow from the test"),
        ("certificate.json", set_in("runs", 0, "sha256", to=lambda text: text[::-1]), "its hash differs"),
        ("certificate.json", set_in("runs", 0, "n_runs", to=one_more), "were certified"),
        ("certificate.json", set_in("test", "hold_probability", to=lambda p: p + 0.01), "the study declares"),
        ("certificate.json", set_in("answers", 0, "claim", to=lambda _: "none holds"), "not ('cheapest'"),
        ("result.json", set_in("answers", 0, "winner", "cost_cents", to=one_more), "the price list says"),
        ("result.json", set_in("answers", 1, "cost_lines", 2, "amount_cents", to=one_more), "cost_lines for 40 robots"),
        ("result.json", set_in("answers", 0, "decisions", 0, "n_runs", to=one_more), "not those of the certificate"),
        ("result.json", set_in("designs", 0, "n_runs", to=one_more), "were certified"),
        ("result.json", set_in("test", "alpha_certify", to=lambda a: a / 2), "the study declares"),
        ("study.json", set_in("study", "requirement", "position_p95_mm", to=one_more), "study is not what was"),
        ("design.json", set_in("cost_cents", to=one_more), "design.json: cost_cents"),
        ("robots-40/design.json", set_in("n_tags", to=one_more), "not the certified design"),
        ("traces.json", set_in("traces", 0, "run", to=one_more), "traces.json: is not what was written"),
        ("certificate.json", set_in("files", to=lambda f: f | {"routes.json": ""}), "routes.json: is missing"),
    ],
)  # fmt: skip
def test_whatever_is_altered_is_told_by_name(folder, file, change, reason):
    alter(folder / file, change)
    assert any(reason in fault for fault in faults(folder)), faults(folder)


def test_one_altered_run_is_found_though_it_passes_as_before(folder):
    table = sqlite3.connect(folder / "runs.sqlite")
    design = json.loads((folder / "result.json").read_text())["answers"][0]["winner"]["design"]
    table.execute(
        "UPDATE runs SET heading_max_rad = heading_max_rad * 1.0000001 WHERE design = ? AND run = 1", [design]
    )
    table.commit()
    table.close()
    (fault,) = faults(folder)
    assert fault == f"runs.sqlite: a run of design {design} is not what was certified: its hash differs"


def test_one_lost_run_is_found(folder):
    table = sqlite3.connect(folder / "runs.sqlite")
    design = json.loads((folder / "result.json").read_text())["answers"][0]["winner"]["design"]
    table.execute("DELETE FROM runs WHERE design = ? AND run = 0", [design])
    table.commit()
    table.close()
    assert any(f"design {design} has 0 runs" in fault for fault in faults(folder))


def test_a_folder_that_lacks_a_file_is_one_line(folder):
    (folder / "runs.sqlite").unlink()
    with pytest.raises(StudyError, match=r"runs.sqlite: is missing"):
        verify(folder)
    assert not (folder / "runs.sqlite").exists()
    (folder / "certificate.json").unlink()
    with pytest.raises(StudyError, match=r"certificate.json: cannot be read"):
        verify(folder)


def test_chosen_designs_are_tried_again_on_fresh_seeds(folder):
    first, second = (rerun(folder, seed, 2) for seed in (None, 99))
    assert [found.n_robots for found in first] == [1, 40]
    for found in (*first, *second):
        assert found.verdict in ("certified", "undecided", "refuted")
        low, high = found.interval
        assert low <= found.n_passed / found.n_runs <= high
    assert [found.verdict for found in first] == ["certified", "certified"]
    with pytest.raises(StudyError, match="the seed of the study itself"):
        rerun(folder, 7, 1)


def test_a_study_that_changed_since_cannot_be_tried_again(tiny, edit, tmp_path):
    out = tmp_path / "out"
    run_study(load_study(tiny), out, 2, lambda stage: None)
    edit("price = 42.00", "price = 41.00", file="prices.toml")
    assert not faults(out)
    with pytest.raises(StudyError, match=r"its files, the map, the catalog or the program changed"):
        rerun(out, None, 1)


# --- Everything at once: two scenarios, a mean and a quantile, a tolerance, an assumption, a budget ---

ALL = (
    "scenarios=[{name = 'worn', set = {'world.dead_share' = 0.1}}]",
    "requirements=[{kind = 'mean', metric = 'position_mean_mm', limit = 14.0}, "
    "{kind = 'quantile', metric = 'position_max_mm', limit = 60.0, quantile = 0.4}]",
    "search.cost_tolerance=0.05",
    "search.assume=['fewer tags', 'fewer antennas']",
    "search.max_runs=120",
)  # fmt: skip


@pytest.fixture(scope="module")
def everything(tmp_path_factory):
    out = tmp_path_factory.mktemp("everything") / "out"
    run_study(load_study(TINY, ALL), out, 2, lambda stage: None)
    return out


def test_an_answer_to_everything_at_once_is_verified_and_the_same_with_other_workers(tiny, tmp_path):
    results = [run_study(load_study(tiny, ALL), tmp_path / str(n), n, lambda stage: None) for n in (1, 2)]
    assert results[0] == results[1]
    assert len(results[0].test.criteria) == 6
    assert faults(tmp_path / "1") == []
    assert any(answer.winner for answer in results[0].answers)
    assert all(design.scenarios.keys() == {"worn"} for design in results[0].designs)
    certificate = json.loads((tmp_path / "1" / "certificate.json").read_text())
    assert any(answer["strictly"] and answer["assumed"] for answer in certificate["answers"])
    refuted_by = {decision.refuted_by for answer in results[0].answers for decision in answer.decisions}
    assert len(refuted_by - {None}) >= 2


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda data: data["answers"][0]["strictly"][0].update(n_runs=2), "its runs say"),
        (lambda data: data.update(strict_threshold=data["strict_threshold"] / 1.7), "strict_threshold is no whole"),
        (lambda data: data["answers"][0]["assumed"].pop(), "assumed for 1 robots"),
        (lambda data: data["answers"][0]["runners_up"].append(0), "runners_up for 1 robots"),
    ],
)  # fmt: skip
def test_what_assumptions_rest_on_is_derived_anew(everything, tmp_path, change, reason):
    folder = shutil.copytree(everything, tmp_path / "altered")
    alter(folder / "certificate.json", change)
    assert any(reason in fault for fault in faults(folder)), faults(folder)


def test_a_budget_ends_early_and_more_of_it_goes_on(tiny, tmp_path):
    out = tmp_path / "out"
    few = run_study(load_study(tiny, ("search.budget_runs=40",)), out, 2, lambda stage: None)
    assert sum(answer.n_runs_used for answer in few.answers) <= 40
    assert any("stopped by budget" in answer.claim for answer in few.answers)
    assert faults(out) == []
    enough = run_study(load_study(tiny), out, 2, lambda stage: None)
    assert all(answer.claim == "cheapest" for answer in enough.answers)
    assert faults(out) == []
