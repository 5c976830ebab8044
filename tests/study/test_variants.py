"""Variants of a study: each is the study that --set would make, and a fault in one is a line that names it."""

import json
from pathlib import Path

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.study import load_study, variant_of
from rfiddesign.study.pipeline import study_hash
from rfiddesign.study.variants import folder_name


@pytest.fixture
def with_variants(tiny):
    """Append text to the tiny study's file."""

    def append(text: str):
        with (tiny / "study.toml").open("a") as stream:
            stream.write(text)
        return tiny

    return append


def entry(name="a", **keys: str) -> str:
    lines = [f"{key} = {value}" for key, value in keys.items()]
    return "\n".join(["[[variants]]", f"name = {json.dumps(name)}", *lines, ""])


def fault_of(folder, *settings) -> str:
    with pytest.raises(StudyError) as caught:
        load_study(folder, settings)
    return str(caught.value).removeprefix(f"{folder}/")


@pytest.mark.parametrize(
    ("keys", "settings"),
    [
        ("{}", ()),
        ('{ estimator = "quantized_ekf" }', ("estimator=quantized_ekf",)),
        # A short name means what it means to --set, also that of the variant's own estimator.
        (
            '{ uses_rssi = false, estimator = "quantized_ekf", pitch_mm = 250 }',
            ("estimator=quantized_ekf", "ekf.uses_rssi=off", "design.pitch_mm=250"),
        ),
        ('{ "world.installation_error_mm" = 5.0 }', ("installation_error_mm=5.0",)),
        # A key in quotes, a dotted key and a table are one and the same.
        ("{ world.installation_error_mm = 5.0 }", ("installation_error_mm=5.0",)),
        ("{ world = { odometry = { noise_mm_per_s = 3.0 } } }", ("world.odometry.noise_mm_per_s=3.0",)),
        ('{ "space.layout" = ["pair"], "fleet.robots" = [3] }', ('space.layout=["pair"]', "fleet.robots=[3]")),
    ],
)
def test_a_variant_is_the_study_with_its_keys_set(with_variants, keys, settings):
    folder = with_variants(entry(set=keys))
    (variant,) = load_study(folder).variants
    alone = load_study(folder, (*settings, "title=A tiny hall (a)"))
    assert variant.study.file.model_dump() == alone.file.model_dump()
    assert study_hash(variant.study) == study_hash(alone)
    assert variant.study.variants == ()


def test_the_study_itself_does_not_depend_on_its_variants(tiny, with_variants):
    before = load_study(tiny)
    after = load_study(with_variants(entry(set='{ estimator = "mcl" }') + '[comparison]\nbase = "a"\n'))
    assert study_hash(after) == study_hash(before)
    assert after.file.model_dump_json() == before.file.model_dump_json()


def test_settings_lie_below_those_of_the_variants(with_variants):
    folder = with_variants(entry(set='{ estimator = "markov", "scenario.duration_s" = 3.0 }'))
    study = load_study(folder, ("duration_s=2.0", "seed=9", "estimator=odometry"))
    (variant,) = study.variants
    assert (study.file.estimator, study.file.scenario.duration_s) == ("odometry", 2.0)
    assert (variant.study.file.estimator, variant.study.file.scenario.duration_s) == ("markov", 3.0)
    assert variant.study.file.seed == study.file.seed == 9


def test_group_condition_and_title_have_defaults(with_variants):
    folder = with_variants(entry("Ä b/c") + entry("d", set='{ title = "mine" }') + entry("e", condition='"x"'))
    first, second, third = load_study(folder).variants
    assert first.listed() == {"name": "Ä b/c", "group": "Ä b/c", "condition": "", "set": {}}
    assert third.listed()["condition"] == "x"
    assert second.settings == {"title": '"mine"'}
    assert [one.study.file.title for one in (first, second)] == ["A tiny hall (Ä b/c)", "mine"]


def test_a_long_title_leaves_room_for_the_variant(with_variants, edit):
    edit('"A tiny hall"', f'"{"x" * 200}"')
    (variant,) = load_study(with_variants(entry("n" * 60))).variants
    assert len(variant.study.file.title) == 200
    assert variant.study.file.title.endswith(f" ({'n' * 60})")


@pytest.mark.parametrize(
    ("name", "folder"),
    [("mcl, matched", "mcl-matched"), ("10.5 mm", "10-5-mm"), ("../Ä/b_c", "ä-b_c"), ("...", ""), ("a" * 60, "a" * 60)],
)
def test_a_folder_is_named_by_letters_and_digits(name, folder):
    assert folder_name(name) == folder


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (entry(set="{ sed = 3 }"), "study.toml: variant 'a': sed: unknown key; allowed: across_mm, aligned_share, "),
        (entry(set='{ "world.delay" = 3 }'), "study.toml: variant 'a': world.delay: unknown key; allowed: "),
        (entry(set="{ world.delay = 3 }"), "study.toml: variant 'a': world.delay: unknown key; allowed: "),
        (
            entry(set="{ delay_s = -1.0 }"),
            "study.toml: variant 'a': world.delay_s: found -1.0; input should be greater",
        ),
        (entry(set='{ seed = "x" }'), "study.toml: variant 'a': seed: found 'x'; input should be a valid integer"),
        (entry(set="{ world = 3 }"), "study.toml: variant 'a': world: unknown key; "),
        (
            entry(set='{ "space.layout" = ["pear"] }'),
            "study.toml: variant 'a': space.layout: found 'pear', must be one",
        ),
        (entry(set='{ prices = "no.toml" }'), "no.toml: variant 'a': cannot be read: No such file or directory"),
        (entry(set='{ "space.antenna" = ["30x30"] }'), "prices.toml: variant 'a': per_robot.antenna: has no price for"),
        (entry(set="{ variants = [] }"), "study.toml: variant 'a': variants: cannot be set by a variant"),
        (entry(set='{ comparison.base = "a" }'), "study.toml: variant 'a': comparison: cannot be set by a variant"),
        (entry(set="3"), "study.toml: variants.0.set: found 3; input should be a valid dictionary"),
        (entry(colour="3"), "study.toml: variants.0.colour: unknown key; allowed: condition, group, name, set"),
        (entry("a" * 61), "study.toml: variants.0.name: found 'aaa"),
        (entry(""), "study.toml: variants.0.name: found ''; string should match pattern"),
        (entry("a\nb"), "study.toml: variants.0.name: found 'a\\nb'; string should match pattern"),
        ("[[variants]]\n", "study.toml: variants.0.name: is missing"),
        ("variants = 3\n", "study.toml: search.variants: unknown key"),
        (entry() + entry(), "study.toml: variants: two are named 'a'; each needs a name of its own"),
        (
            entry("a", group='"g"') + entry("b", group='"g"'),
            "study.toml: variants: 'a' and 'b' have the same group 'g' and condition ''; each pair may occur once",
        ),
        (entry("a b") + entry("a-b"), "study.toml: variant 'a-b': gives the same folder a-b as 'a b'; rename one"),
        (entry("!?"), "study.toml: variant '!?': gives the folder ''; choose another name"),
        (entry("Figures"), "study.toml: variant 'Figures': gives the folder 'figures'; choose another name"),
        ("".join(entry(f"v{i}") for i in range(201)), "study.toml: variants: found [{'name': 'v0'}"),
        (entry() + '[comparison]\nbase = "b"\n', "study.toml: comparison.base: found 'b', must be one of the groups a"),
        ('[comparison]\nbase = "b"\n', "study.toml: comparison.base: found 'b', but the study has no variants"),
    ],
)
def test_a_fault_in_a_variant_is_one_line_that_names_it(with_variants, text, line):
    found = fault_of(with_variants(text))
    assert found.startswith(line)
    assert "\n" not in found


def test_variants_are_not_set_from_the_command_line(with_variants):
    folder = with_variants(entry())
    assert fault_of(folder, "variants=[]").startswith("--set: variants: unknown key; allowed: ")
    assert fault_of(folder, "base=a").startswith("--set: base: unknown key; allowed: ")


def test_a_variant_is_found_by_its_name(with_variants):
    study = load_study(with_variants(entry("ekf", set='{ estimator = "quantized_ekf" }') + entry("mcl")))
    assert variant_of(study, None, "--variant") is study
    assert variant_of(study, "ekf", "--variant").file.estimator == "quantized_ekf"
    with pytest.raises(StudyError, match=r"--variant: found 'elf'; did you mean 'ekf'\? must be one of ekf, mcl"):
        variant_of(study, "elf", "--variant")
    with pytest.raises(StudyError, match=r"--variant: found 'ekf', but the study has no variants"):
        variant_of(study.variants[0].study, "ekf", "--variant")


def test_two_hundred_variants_are_read(with_variants):
    text = "".join(entry(f"v{i}", set=f"{{ seed = {i} }}") for i in range(200))
    assert [variant.study.file.seed for variant in load_study(with_variants(text)).variants] == list(range(200))


def test_the_study_of_savings_asks_every_filter_both_ways():
    """Of the repository: each group in a world as believed, and in one with all mismatches."""
    study = load_study(Path(__file__).parents[2] / "studies" / "estimator-savings")
    groups = {(variant.section.group, variant.section.condition) for variant in study.variants}
    assert len(groups) == len(study.variants) == 12
    assert {condition for _, condition in groups} == {"matched", "all mismatches"}
    wrong = next(v for v in study.variants if (v.section.group, v.section.condition) == ("pmg", "all mismatches"))
    assert wrong.study.file.estimator == "pmg"
    assert wrong.study.file.world.dead_share == 0.05
