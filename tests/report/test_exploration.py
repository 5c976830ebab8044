"""The report of an exploration: sections that are there only with their files, and say what the records say."""

import shutil

import numpy as np
import pytest
from matplotlib.figure import Figure

from rfiddesign.errors import StudyError
from rfiddesign.report.contents import read_contents
from rfiddesign.report.exploration import (
    Explored,
    explored_pictures,
    explored_sentences,
    front_parts,
    front_pictures,
    read_explored,
)
from rfiddesign.report.extras import extras
from rfiddesign.report.figures.exploration import (
    TriedDesigns,
    exploration_figure,
    importance_figure,
    interaction_figure,
)
from rfiddesign.report.page import write_report
from rfiddesign.results.exploration import (
    Exploration,
    FleetExploration,
    FrontOfFleet,
    ImportanceRecord,
    InteractionRecord,
    MemberRecord,
    NamedRecord,
    ObjectiveRecord,
    Pareto,
    TrialRecord,
    VariableRecord,
)
from rfiddesign.results.folder import write_record

VALUES = {"kind": "bar", "tags_per_m2": 25.0, "readers": 4}


def trial(number, score, is_stopped=False, name="bar-4-100"):
    fault = None if score is not None else "sticks out"
    n_runs = 0 if score is None else (4 if is_stopped else 8)
    return TrialRecord(
        number=number, name=name, values=VALUES, cost_cents=100_000 + 10_000 * number, n_runs=n_runs, n_passed=0,
        score=score, fault=fault, is_stopped=is_stopped,
    )  # fmt: skip


def named(number, name, cost_cents, is_tried):
    return NamedRecord(
        number=number, name=name, values=VALUES, n_tags=9, cost_cents=cost_cents, trial=2, is_tried=is_tried
    )


def exploration(n_robots=1, name="bar-4-100"):
    return Exploration(
        sampler="tpe", seed=1, runs_per_trial=8, pilot_runs=4, first_run=10**9, n_designs=1_234_567,
        variables=[VariableRecord(name="kind", values=["bar"])], objectives=["cost"],
        fleets=[
            FleetExploration(
                n_robots=n_robots, currency="EUR", is_cut_short=True,
                trials=[trial(0, 2.0, True), trial(1, None), trial(2, 0.9, name=name), trial(3, 1.2)],
                named=[
                    named(0, name, 120_000, is_tried=True),
                    named(1, "x", 110_000, is_tried=False),
                ],
                importance=[ImportanceRecord(evaluator="ped_anova", shares={"readers": 0.7, "tags_per_m2": 0.3})],
                interactions=[InteractionRecord(first="readers", second="tags_per_m2", share=0.05)],
            )
        ],
    )  # fmt: skip


def pareto(n_robots=1, name="bar-4-100"):
    return Pareto(
        objectives=[
            ObjectiveRecord(name="cost", is_exact=True, is_maximised=False),
            ObjectiveRecord(name="heading_p95_rad", is_exact=False, is_maximised=False),
            ObjectiveRecord(name="speed_mm_per_s", is_exact=True, is_maximised=True),
            ObjectiveRecord(name="convergence_s", is_exact=False, is_maximised=False),
        ],
        slack=2.0, first_run=2 * 10**9,
        fronts=[
            FrontOfFleet(
                n_robots=n_robots, currency="EUR", n_runs=50, knee=1, knee_method="least sum of the objectives",
                members=[
                    MemberRecord(trial=0, name="dear", values=[2000.0, 0.02, 300.0, 2.0],
                                 stderr=[0.0, 0.001, 0.0, 0.1], chance=0.4, is_on_front=False),
                    MemberRecord(trial=2, name=name, values=[1200.0, 0.01, 300.0, 1.5],
                                 stderr=[0.0, 0.001, 0.0, 0.1], chance=0.97, is_on_front=True),
                ],
            )
        ],
    )  # fmt: skip


@pytest.fixture
def folder(finished, tmp_path):
    return shutil.copytree(finished, tmp_path / "out")


def test_a_folder_without_an_exploration_has_no_section_of_one(folder):
    assert read_explored(folder) is None
    assert extras(read_contents(folder)) == ()


@pytest.mark.usefixtures("without_pictures")
def test_a_folder_with_both_files_shows_them_and_trusts_no_text(folder):
    write_record(folder / "exploration.json", exploration(name="<b>bold</b>"))
    write_record(folder / "pareto.json", pareto(name="<b>bold</b>"))
    page = write_report(folder).read_text()
    for key in ("exploration", "pareto", "figure-exploration-robots-1", "figure-importance-robots-1", "figure-front-1"):
        assert f'id="{key}"' in page
    assert "1,234,567 different designs" in page
    assert "<b>bold</b>" not in page
    assert "&lt;b&gt;bold&lt;/b&gt;" in page


def test_a_file_that_is_no_record_is_named(folder):
    (folder / "exploration.json").write_text("{}")
    with pytest.raises(StudyError, match=r"exploration\.json"):
        write_report(folder)


def test_sentences_count_what_was_tried_built_and_named():
    words = " ".join(explored_sentences(Explored(exploration(), None)))
    assert "4 designs tried, of which 3 can be built, on 20 drives" in words
    assert "2 candidates named, 1 of them neighbours" in words
    assert "The budget of time ended the exploration early." in words


def test_the_table_of_a_front_has_its_members_with_errors_and_units():
    (part,) = front_parts(Explored(exploration(), pareto()))
    assert part.table.rows == (
        ("bar-4-100 (knee)", "EUR 1,200.00", "0.57 ± 0.06°", "300 mm/s", "1.50 ± 0.10 s", "97 %"),
    )
    assert "1 of 2 measured designs are on the front, by means over 50 drives" in part.words
    assert "the member with the least sum" in part.words
    assert front_parts(Explored(exploration(), None)) == ()


def test_every_figure_is_drawn(folder):
    explored = Explored(exploration(), pareto())
    found = [*explored_pictures(explored, read_contents(folder)), *front_pictures(explored.pareto)]
    assert [picture.topic for picture in found] == ["exploration", "importance", "importance", "pareto"]
    assert all(isinstance(picture.figure, Figure) for picture in found)


def test_figures_with_nothing_to_show_say_so():
    nothing = np.empty(0)
    tried = TriedDesigns(nothing, nothing, nothing.astype(bool), nothing.astype(bool), nothing, None, "EUR")
    for figure in (exploration_figure(tried), importance_figure({}), interaction_figure(["a", "b"], {})):
        assert figure.axes[0].texts
