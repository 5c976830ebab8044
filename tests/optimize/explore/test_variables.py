"""Variables: what can be made, how many designs that is, and what a proposal is made of."""

from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Point

from rfiddesign.optimize.explore import Choice, Fixed, Range, Variables, fault_of, propose

SMALL = (
    Choice("kind", ("cross", "bar", "ring", "single")),
    Choice("antenna", ("60x60", "80x80")),
    Choice("pattern", ("square",)),
    Choice("estimator", ("mcl", "pmg")),
    Range("tags_per_m2", 10.0, 12.0),
    Range("readers_per_arm", 1, 2),
    Range("readers", 2, 4),
    Range("first_mm", 100.0, 120.0, 10.0),
    Range("spacing_mm", 90.0, 100.0, 5.0),
    Range("radius_mm", 200.0, 201.0),
    Range("n_particles", 100, 300, 100),
)


def test_number_of_designs_is_that_of_the_different_proposals():
    variables = Variables(SMALL)
    grids = {
        each.name: each.values
        if isinstance(each, Choice)
        else [each.made(each.low + i * each.step) for i in range(each.n_values)]
        for each in SMALL
    }
    made = {variables.made(dict(zip(grids, values, strict=True))) for values in product(*grids.values())}
    assert variables.n_designs == len(made)


def test_a_bar_of_a_range_at_a_millimetre_is_counted_by_hand():
    # 3 kinds x 2 antennas x 3 densities x (3 particle counts of mcl + 1 of pmg) x what each kind is made of
    assert Variables(SMALL).n_designs == 2 * 3 * 4 * (2 * 3 * 3 + 3 * 3 + 3 * 2 + 1)


@given(st.floats(0.1, 1000), st.floats(0, 1000), st.sampled_from([0.1, 0.5, 1.0, 25.0]), st.booleans(), st.floats(0, 1))
@settings(deadline=None)
def test_what_is_made_is_the_nearest_step_inside_the_range(low, width, step, is_log, place):
    variable = Range("spacing_mm", low, low + width, step, is_log)
    drawn = low + place * width
    made = variable.made(drawn)
    assert low - 1e-9 <= made <= low + width + 1e-8
    steps = (made - variable.low) / step
    assert steps == pytest.approx(round(steps), abs=1e-6)
    is_end = made > low + width - step
    assert abs(made - drawn) <= step * (1.0 if is_end else 0.5) + 1e-6
    for other in variable.beside(made):
        assert other != made
        assert low - 1e-9 <= other <= low + width + 1e-8


def test_a_proposal_leaves_out_what_its_kind_and_estimator_do_not_use():
    variables = Variables(SMALL)
    drawn = {each.name: each.values[-1] if isinstance(each, Choice) else each.low for each in SMALL}
    bar = dict(variables.made(drawn | {"kind": "bar"}))
    assert set(bar) == {"kind", "antenna", "pattern", "estimator", "tags_per_m2", "readers", "spacing_mm"}
    assert variables.made(drawn | {"kind": "bar", "radius_mm": 201.0}) == tuple(bar.items())


def test_a_proposal_is_the_design_that_its_values_say():
    variables = Variables(SMALL)
    drawn = {
        "kind": "cross", "antenna": "80x80", "estimator": "mcl", "tags_per_m2": 10.7, "readers_per_arm": 2,
        "readers": 3, "first_mm": 118.0, "spacing_mm": 93.0, "radius_mm": 200.2, "n_particles": 240,
    }  # fmt: skip
    proposal = propose(variables.made(drawn), Fixed())
    assert proposal.name == "cross-8-120-95, 80x80, square, 11 tags/m2, mcl, 200 particles"
    assert proposal.design.layout.poses[0] == (120.0, 0.0, 0.0)
    assert proposal.key == propose(variables.made(drawn | {"radius_mm": 201.0}), Fixed()).key
    assert proposal.key != propose(variables.made(drawn | {"tags_per_m2": 10.0}), Fixed()).key
    assert 0 <= proposal.key < 2**63
    assert fault_of(proposal, Point(0, 0).buffer(320.0)) is None
    assert "stick" in fault_of(proposal, Point(0, 0).buffer(150.0))


def test_the_height_of_antennas_is_one_more_variable():
    variables = Variables((*SMALL, Range("antenna_height_mm", 10.0, 30.0)))
    assert variables.n_designs == 21 * Variables(SMALL).n_designs
    drawn = {each.name: each.values[0] if isinstance(each, Choice) else each.low for each in SMALL}
    low, high = (
        propose(variables.made(drawn | {"antenna": "80x80", "antenna_height_mm": height}), Fixed())
        for height in (10.2, 30.0)
    )
    assert ", antennas 10 mm high" in low.name
    # A sphere of 40 mm whose centre is 32 mm below the antenna.
    assert low.design.antenna.area.radius_mm == pytest.approx((40**2 - 22**2) ** 0.5)
    assert high.design.antenna.area.radius_mm == pytest.approx((40**2 - 2**2) ** 0.5)
    assert low.key != high.key


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda found: found[1:], "kind is missing"),
        (lambda found: [each for each in found if each.name != "radius_mm"], "radius_mm is missing, a layout of kind"),
        (lambda found: [*found, Range("first_mm", 1, 2)], "'first_mm' stands there twice"),
        (lambda found: [*found, Range("colour", 1, 2)], "'colour' is no variable"),
        (lambda found: [Choice("kind", ("cross", "star")), *found[1:]], "kind 'star' must be one of"),
        (lambda found: [Range("kind", 1, 2), *found[1:]], "kind must be a list of names"),
    ],
)  # fmt: skip
def test_faulty_variables_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        Variables(tuple(change(list(SMALL))))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("first_mm", 10.0, 5.0), "low is 10 and high 5"),
        (("first_mm", 0.0, 5.0), "must be 0 < low"),
        (("first_mm", 1.0, 5.0, 0.0), "step is 0"),
        (("first_mm", 1.0, 1e6, 1e-6), "more than 1,000,000,000 values"),
        (("readers", 1.5, 4), "must be whole numbers"),
    ],
)
def test_faulty_ranges_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Range(*arguments)


def test_a_layout_of_the_study_is_a_kind_without_variables():
    fixed = Fixed(layouts={"own": propose((("kind", "single"), ("antenna", "60x60"), ("pattern", "square"),
                                           ("tags_per_m2", 9.0)), Fixed()).design.layout})  # fmt: skip
    variables = Variables(
        (
            Choice("kind", ("own",)), Choice("antenna", ("60x60",)), Choice("pattern", ("square",)),
            Range("tags_per_m2", 9, 16),
        ),
        layouts=("own",),
    )  # fmt: skip
    assert variables.n_designs == 8
    assert list(variables.searched) == ["tags_per_m2"]
    assert propose(variables.made({"tags_per_m2": 9.2}), fixed).design.layout.name == "single"
