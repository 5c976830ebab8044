"""When and how surely readers poll."""

import numpy as np
import pytest

from rfiddesign.models.reads import ReadModel


def test_common_polling_is_at_the_end_of_the_step():
    assert np.array_equal(ReadModel().phases(8), np.ones(8))


@pytest.mark.parametrize("n", [1, 2, 8, 96])
def test_staggered_polls_are_evenly_spread_about_the_middle_of_the_step(n):
    phases = ReadModel(polling="staggered").phases(n)
    assert phases.shape == (n,)
    assert np.diff(phases) == pytest.approx(np.full(n - 1, 1 / n))
    assert phases.mean() == pytest.approx(0.5)
    assert phases[0] == pytest.approx(0.5 / n)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"read_probability": 1.1}, "read_probability is 1.1, must be at least 0 and at most 1"),
        ({"read_probability": float("nan")}, "read_probability is nan"),
        ({"polling": "sometimes"}, "polling is 'sometimes', must be one of common, staggered"),
    ],
)
def test_a_bad_argument_is_named_with_its_value_and_bound(arguments, message):
    with pytest.raises(ValueError, match=message):
        ReadModel(**arguments)
