"""Mapping tags on an hour's drive, against windows weighed cell by cell in numpy."""

import numpy as np
import pytest

from rfiddesign.estimators.tag_mapping import by_field, by_reads
from rfiddesign.estimators.tag_mapping.by_field import ByField
from rfiddesign.estimators.tag_mapping.by_reads import ByReads
from rfiddesign.estimators.tag_mapping.likelihood import AdaptiveLikelihood
from rfiddesign.estimators.tag_mapping.window import flat_window
from rfiddesign.models.lobe import Lobe
from rfiddesign.models.polls import Polls
from rfiddesign.reproduce import load_reproduction
from rfiddesign.reproduce.tag_mapping import office
from tests.benchmarks.board import Row, race

DISTANCES = (700.0, 1000.0, 1400.0, 2000.0)
DRIVE_S, BAR_S = 3600.0, 60.0
# The twin maps one tag, and has so many polls for it.
N_TWIN_POLLS = 200


def a_drive():
    """100 tags in 16 x 16 m, a robot with two readers that poll once a second."""
    return office.drive(load_reproduction("tag-mapping").file, Lobe(), DRIVE_S, 0)


def of_a_tag(polls):
    """The reads of one tag, in the polls up to some after its first read."""
    tag = polls.read_tag[0]
    rows = polls.reads_of(tag)
    end = polls.read_poll[rows[0]] + N_TWIN_POLLS
    rows = rows[polls.read_poll[rows] < end]
    return Polls(polls.poses[:end], polls.read_poll[rows], np.zeros(rows.size, int), polls.read_distance_mm[rows], 1)


def centred(polls, tag):
    """The open window of a tag, as places x (n,), y (n, 1) and logarithms (n, n)."""
    first = polls.read_poll[polls.reads_of(tag)[0]]
    window = flat_window(polls.poses[first, :2], 3000.0, 10.0)
    steps = (np.arange(len(window.logs)) - len(window.logs) // 2) * 10.0
    return window.centre_mm[0] + steps, (window.centre_mm[1] + steps)[:, None], window.logs.copy()


def seen(pose, x, y):
    c, s = np.cos(pose[2]), np.sin(pose[2])
    dx, dy = x - pose[0], y - pose[1]
    return c * dx + s * dy, c * dy - s * dx


def numpy_by_reads(settings, polls):
    """As whoever knows numpy writes it: every cell of the window at every read."""
    places = []
    for tag in range(polls.n_tags):
        x, y, logs = centred(polls, tag)
        for row in polls.reads_of(tag):
            said = settings.likelihood.ellipses(polls.read_distance_mm[row])
            u, v = seen(polls.poses[polls.read_poll[row]], x, y)
            core, wide = (
                (2 * u / long - 1) ** 2 + (2 * v / (said.ratio * long)) ** 2 <= 1
                for long in (said.inner_mm, said.outer_mm)
            )
            logs += np.where(
                core, np.float32(said.inner_log), np.where(wide, np.float32(said.outer_log), np.float32(0))
            )
        row, column = np.nonzero(logs == logs.max())
        places.append((x[column].mean(), y[row, 0].mean()))
    return np.array(places)


def numpy_by_field(settings, polls):
    """Every cell of the window at every poll that may see any of it, looked up in the table's nearest entry."""
    field, means = settings.field, []
    n_words, n_u, n_v = field.tables.shape
    for tag in range(polls.n_tags):
        x, y, logs = centred(polls, tag)
        logs = logs.astype(float)
        words = np.full(len(polls.poses), n_words - 1)
        rows = polls.reads_of(tag)
        words[polls.read_poll[rows]] = 1 + np.searchsorted(DISTANCES, polls.read_distance_mm[rows])
        middle = np.array([x[len(x) // 2], y[len(y) // 2, 0]])
        near = np.hypot(*(polls.poses[:, :2] - middle).T) < 3000.0 + field.reach_mm
        for pose, word in zip(polls.poses[near], words[near], strict=True):
            u, v = seen(pose, x, y)
            j = np.clip(np.rint((u - field.low_u) / field.cell_mm), 0, n_u - 1).astype(np.intp)
            k = np.clip(np.rint((v - field.low_v) / field.cell_mm), 0, n_v - 1).astype(np.intp)
            logs += field.tables[word][j, k]
        mass = np.exp(logs - logs.max())
        mass /= mass.sum()
        means.append((mass.sum(axis=0) @ x, mass.sum(axis=1) @ y[:, 0]))
    return np.array(means)


@pytest.mark.parametrize("name", ["reads alone", "reads and silence"])
def test_mapping_100_tags_in_an_hour(benchmark, board, name):
    polls = a_drive().polls
    one, n_tags = of_a_tag(polls), np.unique(polls.read_tag).size
    lobe = Lobe(softness=0.05, read_probability=0.95)
    module, settings, twin = {
        "reads alone": (by_reads, ByReads(AdaptiveLikelihood()), numpy_by_reads),
        "reads and silence": (by_field, ByField(lobe.log_field(DISTANCES, 10.0), DISTANCES), numpy_by_field),
    }[name]
    # Who is fast must also be right, to the cell.
    assert np.abs(module.map_tags(settings, one).mean_mm - twin(settings, one)).max() < 10.0
    assert module.map_tags(settings, polls).n_tags == n_tags > 80
    best = race(
        {"ours": lambda: module.map_tags(settings, one), "numpy": lambda: twin(settings, one)}, 2
    )  # fmt: skip
    board.rows.append(
        Row(
            f"map of one tag, {N_TWIN_POLLS} polls: {name}", "ms", 1e3 * best["ours"], {"numpy": 1e3 * best["numpy"]},
            (("numpy", 10, True),),
        )
    )  # fmt: skip
    hour = race({"ours": lambda: module.map_tags(settings, polls)}, 3)["ours"]
    board.rows.append(
        Row(
            f"map of {n_tags} tags, 10 mm cells, 60 min with 2 readers at 1 Hz: {name}", "s", hour, {"the bar": BAR_S},
            (("the bar", 1, False),),
        )
    )  # fmt: skip
    benchmark.pedantic(lambda: module.map_tags(settings, polls), rounds=2)
