"""tag_mapping_adaptive_likelihood: the gains of its line experiments and of its office, from few drives."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rfiddesign.errors import StudyError
from rfiddesign.reproduce import load_reproduction, reproduce, tag_mapping
from rfiddesign.reproduce.tag_mapping import line, office
from rfiddesign.reproduce.tag_mapping.models import fitted, lobes

STUDY = "tag-mapping"
LINE_ROWS = [f"L={offset}{desk}" for desk in ("", " desk") for offset in (20, 40, 80, 100)]


def small(file):
    """The study's own parameters, with few drives, few tags and cells of 2 cm in the office."""
    fewer = {
        "mapping": file.mapping.model_copy(update={"cell_mm": 20.0}),
        "line": file.line.model_copy(update={"quick_runs": 4, "lengths_mm": [], "signals_db": []}),
        "office": file.office.model_copy(update={"n_tags": 30, "quick_duration_s": 1800.0, "marks_m": [1.0, 2.0]}),
    }
    return file.model_copy(update=fewer)


@cache
def found():
    loaded = load_reproduction(STUDY)
    return reproduce(replace(loaded, file=small(loaded.file)), is_quick=True, n_workers=2)


def number(table, row, metric):
    (only,) = [r.measured for r in found().rows if (r.table, r.row, r.metric) == (table, row, metric)]
    return only


def test_every_number_that_the_paper_prints_has_a_row_and_every_claim_a_number():
    loaded = load_reproduction(STUDY)
    rows = {(row.table, row.row): row for row in found().rows}
    assert all(("line", row) in rows for row in LINE_ROWS)
    for row in ("1 m in contact", "2 m in contact", "1 m driven", "2 m driven"):
        assert ("office", row) in rows
        assert ("office, UHF sector", row) in rows
    published = {
        (table, row, metric): value
        for table, named in loaded.expected.published.items()
        for row, numbers in named.items()
        for metric, value in numbers.items()
    }
    shown = {(row.table, row.row, row.metric): row.published for row in found().rows if row.published is not None}
    # The marks of 10 m are left out here.
    assert shown == {key: value for key, value in published.items() if not key[1].startswith("10 m")}
    assert all(claim.holds for claim in found().claims)
    assert all(math.isfinite(row.measured) for row in found().rows)
    assert set(found().figures) == {"line", "posterior", "office"}


def test_the_map_of_the_office_is_kept_with_covariances():
    header, *lines = found().files["tag_map.csv"].splitlines()
    assert header == "tag,x_mm,y_mm,var_x_mm2,cov_xy_mm2,var_y_mm2,n_reads"
    values = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    file = small(load_reproduction(STUDY).file)
    true, _ = lobes(fitted(file.mapping, file.office.paper), file.office.paper)
    tags_mm = office.drive(file, true, file.office.quick_duration_s, 0).tags_mm
    off = np.hypot(*(values[:, 1:3] - tags_mm[values[:, 0].astype(int)]).T)
    assert len(values) > 20
    assert np.median(off) < 300
    assert (values[:, 3] * values[:, 5] > values[:, 4] ** 2).all()


def test_the_adaptive_model_gains_where_the_tag_is_near_and_neither_does_after_the_turn():
    gains = [number("line", f"L={offset}", "gain_cm") for offset in (20, 40, 80)]
    assert gains == sorted(gains, reverse=True)
    for offset in (20, 40):
        before, after = (number("line", f"L={offset}", f"fixed{when}_cm") for when in ("", "_after"))
        assert after < before / 5
    # A stronger signal makes cores smaller: nearer at 40 cm, too near at 80 cm.
    assert number("line", "L=40 desk", "adaptive_cm") < number("line", "L=40", "adaptive_cm") - 4
    for row, printed in (("L=20", 320), ("L=40 desk", 310), ("L=80", 280), ("L=80 desk", 280)):
        assert abs(number("line", row, "read_again_cm") - printed) < 40


def test_in_the_office_contact_makes_tags_known_and_silence_and_distances_help():
    for table in ("office", "office, UHF sector"):
        for mark in ("1 m", "2 m"):
            fixed, adaptive, field = (
                number(table, f"{mark} in contact", f"{model}_cm") for model in ("fixed", "adaptive", "field_distances")
            )
            assert fixed > adaptive > field
            assert number(table, f"{mark} driven", "fixed_cm") > fixed
        assert number(table, "2 m in contact", "fixed_cm") < 0.7 * number(table, "1 m in contact", "fixed_cm")
    # In a world as believed the covariance is honest; where reads are certain, it is cautious.
    assert 1.2 < number("office, UHF sector", "covariance of read field, distances", "nees") < 3.0


def test_the_numbers_do_not_depend_on_the_number_of_workers():
    loaded = load_reproduction(STUDY)
    file = small(loaded.file)
    file = file.model_copy(
        update={"office": file.office.model_copy(update={"n_tags": 5, "quick_duration_s": 300.0, "quick_runs": 2})}
    )
    one, two = (reproduce(replace(loaded, file=file), is_quick=True, n_workers=n) for n in (1, 2))
    assert [row.as_json() for row in one.rows] == [row.as_json() for row in two.rows]


@pytest.mark.parametrize("run", range(3))
def test_a_robot_wanders_in_passages_only_at_its_speed(run):
    section = load_reproduction(STUDY).file.office
    poses = office.wander(section, 2000.0, np.random.default_rng(run))
    pitch = (16_000.0 - 2000.0) / 3
    x, y = poses[:, 0], poses[:, 1]
    in_passage = [(c % pitch >= 200.0 - 1e-6) & (c % pitch <= 1800.0 + 1e-6) for c in (x, y)]
    assert (in_passage[0] | in_passage[1]).all()
    assert ((poses[:, :2] >= 200.0) & (poses[:, :2] <= 15_800.0)).all()
    steps = np.diff(poses[:, :2], axis=0)
    assert np.hypot(*steps.T) == pytest.approx(np.full(len(steps), 200.0))
    assert np.arctan2(steps[:, 1], steps[:, 0]) == pytest.approx(np.angle(np.exp(1j * poses[1:, 2])))
    # Away from walls it turns by 15 degrees at most.
    turns = np.abs(np.diff(poses[:, 2]))
    assert np.mean(turns <= math.radians(15.0) + 1e-9) > 0.7
    # It gets around: the office is 16 m wide.
    assert np.ptp(x) > 8000.0
    assert np.ptp(y) > 8000.0


def test_contact_counts_places_where_the_tag_is_read_and_driving_all_since_the_first():
    file = load_reproduction(STUDY).file
    drive = office.drive(file, lobes(fitted(file.mapping, file.office.paper), file.office.paper)[0], 600.0, 0)
    tag = int(np.argmax(np.bincount(drive.polls.read_tag)))
    polls = drive.polls.read_poll[drive.polls.reads_of(tag)]
    ways = drive.ways_mm(tag)
    come, ends = ways["in contact"]
    assert come[-1] == 200.0 * len(set((polls // 2).tolist()))
    assert ends[0] == 2 * (polls[0] // 2 + 1)
    come, ends = ways["driven"]
    assert come[-1] == 200.0 * (600 - polls[0] // 2)
    assert ends[-1] == 1200


def test_the_line_has_an_antenna_to_either_side_and_the_tag_is_read_by_one_going_and_the_other_coming():
    file = load_reproduction(STUDY).file
    past = line.drive(file, 400.0, 0.0, 0)
    looks = past.polls.read_poll % 2
    is_before = past.read_at < past.n_before
    assert set(looks[is_before]) == {0}
    assert set(looks[~is_before]) == {1}
    assert past.driven_mm[past.n_before - 1] <= 2700.0 < past.driven_mm[past.n_before]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("cell_mm = 10.0", "cell_mm = 1.0", "cell_mm"),
        ("distances_mm = [700.0, 1000.0,", "distances_mm = [1700.0, 1000.0,", "distances_mm must rise"),
        ("tag_at_mm = 1400.0", "tag_at_mm = 3400.0", "tag_at_mm must be at most length_mm"),
        ("poll_mm = 100.0", "poll_mm = 2800.0", "poll_mm must be at most length_mm"),
        ("turn_deg = 15.0\npoll_s = 1.0", "turn_deg = 15.0\npoll_s = 10.5", "must be at most passage_mm"),
        ("n_passages = 4", "n_passages = 9", "passages are wider than the office"),
        ("wall_mm = 200.0", "wall_mm = 1000.0", "wall_mm leaves nothing"),
        ("side_m = 16.0", "side_mm = 16.0", "side_mm"),
        ("poll_s = 1.0", "poll_s = 0.01", "more than 100,000 polls"),
        ("believed_softness = 0.1", "believed_softness = 0.9", "office.uhf.*cell_mm"),
        ('kind = "tag_mapping"', 'kind = "tag_maping"', "must be one of"),
    ],
)
def test_a_study_file_with_a_mistake_is_refused_with_the_key(tmp_path, old, new, words):
    text = load_reproduction(STUDY).path.read_text()
    assert text.count(old) == 1
    (tmp_path / "study.toml").write_text(text.replace(old, new))
    with pytest.raises(StudyError, match=words):
        load_reproduction(str(tmp_path))


def test_more_tags_near_the_robot_than_can_be_listed_end_in_one_line(monkeypatch):
    monkeypatch.setattr("rfiddesign.simulation.tag_polls.MAX_PAIRS", 10)
    monkeypatch.setattr(line, "measure", lambda *arguments, **settings: [])
    with pytest.raises(StudyError, match=r"office: polls have .* tags near them in all, at most 10 are allowed"):
        tag_mapping.measure(load_reproduction(STUDY), 1, lambda *arguments: None, is_quick=True)
