"""Tags mapped by a read field: brute force over all polls, honest covariances, and what silence tells."""

import numpy as np
import pytest

from rfiddesign.estimators.tag_mapping import by_field, by_reads
from rfiddesign.estimators.tag_mapping.by_field import ByField
from rfiddesign.estimators.tag_mapping.by_reads import ByReads
from rfiddesign.estimators.tag_mapping.likelihood import FixedLikelihood
from rfiddesign.estimators.tag_mapping.window import flat_window
from rfiddesign.models.lobe import Lobe
from rfiddesign.models.polls import Polls
from rfiddesign.simulation.tag_polls import poll_tags
from tests.estimators.tag_mapping.numpy_windows import cells_of, looked_up, moments_of

DISTANCES = (700.0, 1000.0, 1400.0)
LOBE = Lobe("sector", beam_deg=70.0, softness=0.12, read_probability=0.8)
COARSE = {"cell_mm": 60.0, "radius_mm": 1500.0}


def drive(seed, n_polls=60, n_tags=4, lobe=LOBE, distances=DISTANCES):
    """Polls from anywhere in a square of 3 m, looking anywhere, with tags in its middle."""
    rng = np.random.default_rng(seed)
    poses = np.column_stack([rng.uniform(0, 3000, (n_polls, 2)), rng.uniform(-np.pi, np.pi, n_polls)])
    tags = rng.uniform(800, 2200, (n_tags, 2))
    return poll_tags(lobe, poses, tags, distances, rng), tags


@pytest.mark.parametrize("distances", [(), DISTANCES], ids=["reads are alike", "reads at distances"])
def test_the_posterior_is_that_of_all_polls_those_without_a_read_too(distances):
    polls, _ = drive(1)
    field = LOBE.log_field(distances or DISTANCES[-1:], 60.0)
    settings = ByField(field, distances, **COARSE)
    mapped = by_field.map_tags(settings, polls)
    assert mapped.n_tags == 4
    for tag, mean, covariance in zip(mapped.tag_id, mapped.mean_mm, mapped.covariance_mm2, strict=True):
        rows = polls.reads_of(tag)
        window = flat_window(polls.poses[polls.read_poll[rows[0]], :2], 1500.0, 60.0)
        places, logs = cells_of(window), window.logs.astype(float)
        said = np.full(len(polls.poses), len(field.tables) - 1)
        said[polls.read_poll[rows]] = [1 + DISTANCES.index(d) for d in polls.read_distance_mm[rows]] if distances else 0
        for pose, word in zip(polls.poses, said, strict=True):
            logs = logs + looked_up(pose, places, field.tables[word], field)
        own, spread = moments_of(np.exp(logs - logs.max()), places)
        assert mean == pytest.approx(own, abs=0.5)
        assert covariance == pytest.approx(spread + np.eye(2) * 300.0, rel=5e-3, abs=5.0)


def test_beliefs_on_the_way_are_those_of_shorter_drives():
    polls, _ = drive(2)
    settings = ByField(LOBE.log_field(DISTANCES, 60.0), DISTANCES, **COARSE)
    first = polls.read_poll[polls.reads_of(0)[0]]
    ends = np.array([first + 1, 40, 60])
    means, covariances, _ = by_field.follow(settings, polls, 0, ends)
    for end, mean, covariance in zip(ends, means, covariances, strict=True):
        is_before = polls.read_poll < end
        shorter = Polls(
            polls.poses[:end], polls.read_poll[is_before], polls.read_tag[is_before],
            polls.read_distance_mm[is_before], polls.n_tags,
        )  # fmt: skip
        found = by_field.map_tags(settings, shorter)
        at = found.tag_id.tolist().index(0)
        assert found.mean_mm[at] == pytest.approx(mean, abs=0.2)
        assert found.covariance_mm2[at] == pytest.approx(covariance, rel=1e-3)


def test_errors_are_as_large_as_the_covariance_says():
    """In a world as believed: squared errors over the covariance are 2 in the mean, half of them within ln 4."""
    field = LOBE.log_field(DISTANCES, 30.0)
    settings, squares = ByField(field, DISTANCES, cell_mm=30.0, radius_mm=1800.0), []
    for seed in range(40):
        polls, tags = drive(seed, n_polls=120, n_tags=6)
        mapped = by_field.map_tags(settings, polls)
        off = mapped.mean_mm - tags[mapped.tag_id]
        squares.extend(np.einsum("ni,ni->n", off, np.linalg.solve(mapped.covariance_mm2, off[..., None])[..., 0]))
    squares = np.array(squares)
    # 240 tags: the mean of as many chi-squares of two varies by 0.13, the share by 0.03.
    assert 1.6 < squares.mean() < 2.5
    assert 0.4 < (squares < 2 * np.log(2)).mean() < 0.6


def test_silence_tells_and_so_do_distances():
    """Mean error over drives: reads alone, with silence, with the distances as well."""
    sums = np.zeros(3)
    lobe = Lobe("ellipse", softness=0.05, read_probability=0.95)
    reads = ByReads(FixedLikelihood(1400.0), cell_mm=20.0, radius_mm=1800.0)
    for seed in range(8):
        polls, tags = drive(seed, n_polls=200, n_tags=5, lobe=lobe)
        models = [
            (by_reads, reads),
            (by_field, ByField(lobe.log_field(DISTANCES[-1:], 20.0), (), 20.0, 1800.0)),
            (by_field, ByField(lobe.log_field(DISTANCES, 20.0), DISTANCES, 20.0, 1800.0)),
        ]
        for k, (module, settings) in enumerate(models):
            mapped = module.map_tags(settings, polls)
            sums[k] += np.hypot(*(mapped.mean_mm - tags[mapped.tag_id]).T).mean()
    assert sums[0] > 1.2 * sums[1] > 1.2 * 1.2 * sums[2]


def test_what_does_not_fit_is_refused():
    polls, _ = drive(1)
    field = LOBE.log_field(DISTANCES, 60.0)
    with pytest.raises(ValueError, match="distances_mm"):
        ByField(field, (700.0,))
    with pytest.raises(ValueError, match="cell_mm"):
        ByField(field, cell_mm=0.5)
    with pytest.raises(ValueError, match="none of distances_mm"):
        by_field.map_tags(ByField(field, (700.0, 1000.0, 1300.0), **COARSE), polls)
    with pytest.raises(ValueError, match="ends"):
        by_field.follow(ByField(field, DISTANCES, **COARSE), polls, 0, np.array([0]))
    never = Polls(polls.poses, *(np.zeros(0, int),) * 2, np.zeros(0), 1)
    with pytest.raises(ValueError, match="never read"):
        by_field.follow(ByField(field, DISTANCES, **COARSE), never, 0, np.array([60]))
