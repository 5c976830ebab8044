"""Logs of surveys: what was written is read again, and what is no log is refused in one line."""

import math
import shutil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rfiddesign.errors import StudyError
from rfiddesign.geometry import ReaderLayout
from rfiddesign.models.survey_files import POSES, READS, SCHEDULE, read_survey_log, write_survey_log
from rfiddesign.models.survey_log import SurveyLog

LAYOUT = ReaderLayout("two", ((100.0, 0.0, 0.0), (-50.0, 20.0, 0.5)))


@st.composite
def logs(draw):
    """Stretches of a straight drive, polls of two antennas, and reads of some of these."""
    lengths = draw(st.lists(st.integers(2, 6), min_size=1, max_size=4))
    time, stretch, now = [], [], draw(st.integers(0, 10**6))
    for k, length in enumerate(lengths):
        now += draw(st.integers(1, 1000))
        time += [(now + i) / 10 for i in range(length)]
        stretch += [3 * k] * length
        now += length
    n = len(time)
    places = st.lists(st.floats(-5e6, 5e6), min_size=3 * n, max_size=3 * n)
    poses = np.array(draw(places)).reshape(n, 3) * [1.0, 1.0, 1e-3]
    first, period = np.array([0.1, 0.05]), np.array([0.1, 0.2])
    log = SurveyLog(np.array(time), np.array(stretch), poses, first, period, *(np.empty(0, int) for _ in range(3)))
    polls = log.polls(LAYOUT)
    # Only the first antenna polls at whole tenths of a second.
    antenna = np.where(np.abs(polls.time_s * 10 - np.rint(polls.time_s * 10)) < 1e-3, 0, 1)
    chosen = np.array(draw(st.lists(st.booleans(), min_size=len(antenna), max_size=len(antenna))), bool)
    tags = np.array(draw(st.lists(st.integers(0, 2**31 - 1), min_size=len(antenna), max_size=len(antenna))), int)
    return SurveyLog(
        log.time_s, log.stretch, log.poses, first, period, polls.time_s[chosen], antenna[chosen], tags[chosen]
    )  # fmt: skip


@given(log=logs())
def test_a_log_survives_its_files(log, tmp_path_factory):
    folder = tmp_path_factory.mktemp("log")
    write_survey_log(folder, log)
    again = read_survey_log(folder)
    for name, scale in (("time_s", 1e-6), ("stretch", 0), ("first_poll_s", 1e-9), ("poll_period_s", 1e-9),
                        ("read_time_s", 1e-6), ("read_antenna", 0), ("read_tag", 0)):  # fmt: skip
        assert getattr(again, name) == pytest.approx(getattr(log, name), abs=scale or 1e-12, rel=0)
    assert again.poses == pytest.approx(log.poses, abs=1e-3, rel=0)
    ours, theirs = log.polls(LAYOUT), again.polls(LAYOUT)
    assert np.array_equal(ours.has_read, theirs.has_read)
    assert np.array_equal(ours.read_tag, theirs.read_tag)
    shutil.rmtree(folder)


@pytest.fixture
def folder(tmp_path):
    """A good log of a second, with a read by each of two antennas."""
    rows = "".join(f"{0.1 * k:.1f},0,{30 * k},0,0\n" for k in range(11))
    (tmp_path / POSES).write_text("time_s,stretch,x_mm,y_mm,heading_rad\n" + rows)
    (tmp_path / READS).write_text("time_s,antenna,tag\n0.30,0,7\n0.45,1,8\n")
    (tmp_path / SCHEDULE).write_text("antenna,first_s,period_s\n0,0.1,0.1\n1,0.05,0.1\n")
    return tmp_path


def test_a_good_log_is_read(folder):
    polls = read_survey_log(folder).polls(LAYOUT)
    assert len(polls.time_s) == 20
    assert polls.time_s[polls.read_poll] == pytest.approx([0.3, 0.45])
    assert polls.read_tag.tolist() == [7, 8]
    # Antennas lie 100 mm ahead of and 50 mm behind the robot, which is at 300 mm per second.
    assert polls.antenna_poses[polls.read_poll] == pytest.approx(np.array([[190.0, 0.0, 0.0], [85.0, 20.0, 0.5]]))


def test_antennas_in_any_order_and_no_reads_at_all_are_fine(folder):
    (folder / SCHEDULE).write_text("antenna,first_s,period_s\n1,0.05,0.1\n0,0.1,0.1\n")
    (folder / READS).write_text("time_s,antenna,tag\n")
    log = read_survey_log(folder)
    assert log.first_poll_s.tolist() == [0.1, 0.05]
    assert not log.polls(LAYOUT).has_read.any()


@pytest.mark.parametrize(
    ("file", "text", "told"),
    [
        (POSES, "", "must begin with time_s,stretch"),
        (POSES, "time_s,stretch,x_mm,y_mm,heading_rad\n", "must be (n, 3)"),
        (POSES, "time_s,stretch,x_mm,y_mm,heading_rad\n0,0,0,0,0\n1,0,x,0,0\n", "line 3 is '1,0,x,0,0'"),
        (POSES, "time_s,stretch,x_mm,y_mm,heading_rad\n0,0,0,0,0\n1,0,0,0\n", "line 3 is '1,0,0,0'"),
        (POSES, "time_s,stretch,x_mm,y_mm,heading_rad\n0,0,0,0,0\n\n1,0,0,0,0\n", "line 3 is ''"),
        (POSES, "time_s,stretch,x_mm,y_mm,heading_rad\n0,0,0,0,0\n1,0,nan,0,0\n", "line 3: x_mm is nan"),
        (POSES, "time_s,stretch,x_mm,y_mm,heading_rad\n0,0,0,0,0\n1,0,1e300,0,0\n", "line 3: x_mm is 1e+300"),
        (POSES, "time_s,stretch,x_mm,y_mm,heading_rad\n0,0,0,0,0\n1,0.5,0,0,0\n", "stretch is 0.5"),
        (POSES, "time_s,stretch,x_mm,y_mm,heading_rad\n1,0,0,0,0\n1,0,0,0,0\n", "do not rise after 1 s"),
        (POSES, "time_s,stretch,x_mm,y_mm,heading_rad\n0,2,0,0,0\n1,1,0,0,0\n", "stretches fall after 0 s"),
        (
            POSES,
            "time_s,stretch,x_mm,y_mm,heading_rad\n0,0,0,0,0\n0.5,0,0,0,0\n1.6,0,0,0,0\n",
            "a gap of 1.1 s after 0.5 s, at most 1 s is allowed within a stretch: number stretches anew at gaps",
        ),
        (POSES, "time_s,stretch,x_mm,y_mm,heading_rad\n0,0,0,0,0\n1,1,0,0,0\n", "no stretch has two poses"),
        (POSES, "\xff\xfe", "is not plain text"),
        (READS, "time_s,antenna,tag\n0.3,0,-1\n", "tag is -1"),
        (READS, "time_s,antenna,tag\n0.3,2,1\n", "antenna 2, the schedule has 2"),
        (READS, "time_s,antenna,tag\n0.3,1e10,1\n", "antenna is 1e+10"),
        (SCHEDULE, "antenna,first_s,period_s\n", "has no antenna"),
        (SCHEDULE, "antenna,first_s,period_s\n0,0,0.1\n0,0,0.1\n", "the antennas 0 to 1"),
        (SCHEDULE, "antenna,first_s,period_s\n0,0,0\n1,0,1\n", "has the period 0 s"),
    ],
)
def test_what_is_no_log_is_refused_in_one_line(folder, file, text, told):
    (folder / file).write_text(text, encoding="latin-1")
    with pytest.raises(StudyError) as caught:
        read_survey_log(folder)
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


def a_log(time, stretch, n_antennas, period_s):
    """A log of a robot that stands still and reads nothing."""
    schedule, nothing = np.full(n_antennas, period_s), np.empty(0, int)
    return SurveyLog(time, stretch, np.zeros((len(time), 3)), schedule, schedule, nothing, nothing, nothing)


def test_a_gap_between_stretches_may_be_long():
    log = a_log(np.array([0.0, 1.0, 500.0, 501.0]), np.array([0, 0, 1, 1]), 1, 0.1)
    assert log.driven_s == 2.0
    assert len(log.polls(ReaderLayout("one", LAYOUT.poses[:1])).time_s) == 20


def test_more_polls_than_a_computer_holds_are_refused():
    time = np.arange(502.0)
    with pytest.raises(ValueError, match=r"1e\+07 polls, at most 10,000,000"):
        a_log(time, np.zeros(502, int), 2, 1e-4)
    with pytest.raises(ValueError, match="2,000 stretches of 9,999 antennas, at most 10,000,000"):
        a_log(np.arange(4000.0), np.repeat(np.arange(2000), 2), 9_999, 1e4)


def test_a_missing_file_is_named(folder):
    (folder / READS).unlink()
    with pytest.raises(StudyError, match=r"reads\.csv: cannot be read"):
        read_survey_log(folder)


@pytest.mark.parametrize("time", ["0.34", "1.5", "-0.5"])
def test_a_read_between_polls_or_outside_the_drive_is_refused(folder, time):
    (folder / READS).write_text(f"time_s,antenna,tag\n{time},0,7\n")
    log = read_survey_log(folder)
    with pytest.raises(ValueError, match="is of no poll of antenna 0"):
        log.polls(LAYOUT)


def test_a_layout_with_another_number_of_antennas_is_refused(folder):
    with pytest.raises(ValueError, match="has 2 antennas, the layout has 1"):
        read_survey_log(folder).polls(ReaderLayout("one", LAYOUT.poses[:1]))


def test_headings_turn_the_short_way_between_poses(folder):
    (folder / POSES).write_text("time_s,stretch,x_mm,y_mm,heading_rad\n0,0,0,0,3.1\n1,0,0,0,-3.1\n")
    (folder / READS).write_text("time_s,antenna,tag\n")
    polls = read_survey_log(folder).polls(LAYOUT)
    mine = np.isclose(polls.time_s, 0.5)
    assert polls.antenna_poses[mine][0] == pytest.approx([-100.0, 0.0, math.pi], abs=1e-6)


def test_the_log_before_a_stretch_is_that_part_of_it():
    time, stretch = np.arange(12) / 10, np.repeat([0, 1, 2], 4)
    log = SurveyLog(
        time, stretch, np.zeros((12, 3)), np.array([0.1]), np.array([0.1]), np.array([0.2, 0.6, 1.1]), np.zeros(3, int),
        np.arange(3),
    )  # fmt: skip
    before = log.before(2)
    assert before.time_s.tolist() == time[:8].tolist()
    assert before.read_tag.tolist() == [0, 1]
    with pytest.raises(ValueError, match="nothing was driven before"):
        log.before(0)
