"""Bad input: one line on standard error that names file, key, value and what is allowed; status 2; nothing written."""

import os
import shutil
from pathlib import Path

import pytest

STUDY_FAULTS = {
    "unknown key": ("seed = 7", "sed = 7", "study.toml: sed: unknown key; did you mean seed? allowed: comparison, "),
    "wrong type": ("seed = 7", 'seed = "x"', "study.toml: seed: found 'x'; input should be a valid integer"),
    "wrong unit": (
        "[search]",
        "[design]\npitch_cm = 3\n[search]",
        "study.toml: design.pitch_cm: unknown key; did you mean pitch_mm? allowed: antenna, layout, pattern, ",
    ),
    "negative": ("[6.0, 5.0]", "[-6.0, 5.0]", "floor.rectangle_m.0: found -6.0; input should be greater than 0"),
    "a density without end": ("225.0]", "1e12]", "space.tags_per_m2.2: found 1000000000000.0; input should be less"),
    "too many tags": (
        "[6.0, 5.0]",
        "[5000.0, 4000.0]",
        "space.tags_per_m2: 16 tags/m2 on 20,000,000 m2 are 320,000,000 tags, at most 20,000,000 are allowed",
    ),
    "a floor without end": (
        "[6.0, 5.0]",
        "[1e7, 5.0]",
        "floor.rectangle_m: length_mm is 1e+10; allowed is more than 0",
    ),
    "a floor too small": ("[6.0, 5.0]", "[0.5, 5.0]", "floor.rectangle_m: footprint_radius_mm is 300: the robot does"),
    "empty space": ('["cross-8", "pair"]', "[]", "space.layout: found []; list should have at least 1 item"),
    "a value twice": ('["cross-8", "pair"]', '["pair", "pair"]', "space.layout: found ['pair', 'pair'], must not name"),
    "a fleet twice": ("[1, 40]", "[5, 5]", "fleet: robots is [5, 5], must not name a size twice"),
    "the limits' own factor": ("[1.5]", "[1.0]", "search: limit_factors is [1.0], must not name a factor twice, nor 1"),
    "a factor without end": ("[1.5]", "[1e9]", "search.limit_factors: position_p95_mm is 13000000000.0, must be above"),
    "an alpha that is none": (
        "alpha_refute = 0.1",
        "alpha_refute = 0.9",
        "search.alpha_refute: found 0.9; input should",
    ),
    "unknown layout": ('"cross-8", ', '"corss-8", ', "space.layout: found 'corss-8', must be one of pair, cross-96, "),
    "unknown antenna": ('"80x80"]', '"80x81"]', "space.antenna: antenna is '80x81', must be one of 30x30, 60x60, "),
    "unknown kind": ('kind = "bar"', 'kind = "bra"', "layouts.pair: layout kind = 'bra': must be one of cross, "),
    "a reader too few": ("n = 2", "n = 0", "layouts.pair: n = 0: must be a whole number from 1 to 10000"),
    "a number of 6,000 digits": ("seed = 7", "seed = 0x" + "f" * 5000, "seed: found a number of thousands of digits; "),
    "a run too long": (
        "duration_s = 5.0",
        "duration_s = 36000.0\ndt_s = 0.001",
        "scenario: duration_s is 36000.0, must",
    ),
    "nothing scored": ("duration_s = 5.0", "duration_s = 5.0\nsettle_s = 5.0", "scenario: settle_s is 5.0, must be at"),
    "a screen that leaves nothing": (
        "[search]",
        "[search]\nmin_expected_reads = 1e3",
        "search.min_expected_reads: every design has fewer than 1000 expected reads per poll of all readers",
    ),
    "no such map": ("rectangle_m = [6.0, 5.0]", 'map = "no/map.yaml"', "no/map.yaml: cannot be read: No such file"),
    "no such price list": ("seed = 7", 'seed = 7\nprices = "no.toml"', "no.toml: cannot be read: No such file or"),
    "not TOML": ("seed = 7", "seed = = 7", "study.toml: is not TOML: Invalid value (at line 3, column 8)"),
}


def assert_is_one_line(answer, words: str) -> None:
    assert answer.status == 2
    assert answer.out == ""
    assert answer.err.startswith("rfiddesign: ")
    assert answer.err.count("\n") == 1
    assert words in answer.err


@pytest.mark.parametrize(("old", "new", "words"), STUDY_FAULTS.values(), ids=STUDY_FAULTS)
def test_a_faulty_study_is_refused_before_anything_is_written(cli, tiny, edit, old, new, words):
    edit(old, new)
    assert_is_one_line(cli("run", tiny, "--out", "out"), words)
    assert list(Path.cwd().iterdir()) == []


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "spacing_mm = 200.0",
            "spacing_mm = 20.0",
            "antennas 1 (x = 0, y = -10) and 2 (x = 0, y = 10) overlap by 40 mm",
        ),
        ("spacing_mm = 200.0", "spacing_mm = 600.0", "antenna 1 (x = 0, y = -300) sticks out of the footprint by"),
    ],
)
def test_antennas_that_cannot_be_mounted_are_named(cli, tiny, edit, old, new, words):
    edit(old, new)
    edit('["cross-8", "pair"]', '["pair"]')
    assert_is_one_line(
        cli("run", tiny, "--out", "out"), f"study.toml: space: no design can be built: layout pair: {words}"
    )
    assert_is_one_line(cli("evaluate", tiny, "--set", "layout=pair"), f"study.toml: design: layout pair: {words}")
    assert_is_one_line(cli("coverage", tiny, "--set", "layout=pair"), f"study.toml: design: layout pair: {words}")
    assert list(Path.cwd().iterdir()) == []


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"80x80" = { price = 10.00, source = "assumption" }', "", "has no price for antenna '80x80' of space.antenna"),
        ("price = 42.00", "price = -1", "prices.toml: per_robot.reader.price: found -1; input should be greater than"),
        ("price = 42.00", 'price = "42"', "prices.toml: per_robot.reader.price: found '42', must be a number"),
        ("reader = { price", "reader = { prize", "prices.toml: per_robot.reader.price: is missing (and 1 more)"),
        (', source = "offer"', "", "prices.toml: per_robot.reader.source: is missing"),
        ('currency = "EUR"', 'currency = "Euro"', "prices.toml: currency: found 'Euro'; string should match pattern"),
    ],
)
def test_a_faulty_price_list_is_refused(cli, tiny, edit, old, new, words):
    edit(old, new, file="prices.toml")
    assert_is_one_line(cli("run", tiny, "--out", "out"), words)
    assert list(Path.cwd().iterdir()) == []


def test_a_map_without_free_space_is_refused(cli, tiny, grey_map):
    grey_map(0)
    assert_is_one_line(cli("run", tiny, "--out", "out"), "floor/map.yaml: no free space")
    assert list(Path.cwd().iterdir()) == []


@pytest.mark.parametrize("command", ["run", "check", "evaluate", "coverage"])
@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "study.toml: cannot be read: No such file or directory"),
        (b"\xff", "study.toml: is not UTF-8 text"),
        (b"#" * 2_000_000, "study.toml: is too large, at most 1,000,000 bytes are allowed"),
        (b"", "study.toml: title: is missing (and 2 more)"),
    ],
)
def test_a_study_file_that_cannot_be_read_is_refused_by_every_command(cli, tiny, command, content, words):
    (tiny / "study.toml").unlink()
    if content is not None:
        (tiny / "study.toml").write_bytes(content)
    assert_is_one_line(cli(command, tiny), words)
    assert list(Path.cwd().iterdir()) == []


def test_an_endless_file_is_not_read_to_its_end(cli):
    assert_is_one_line(cli("check", "/dev/zero"), "/dev/zero: is too large")


def test_a_name_longer_than_any_file_s_is_one_line(cli, tiny):
    assert_is_one_line(cli("check", "a" * 5000), "cannot be read: File name too long")
    assert_is_one_line(cli("run", tiny, "--out", "a" * 5000), "File name too long")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--out", "file/below"], "file/below: cannot be written: Not a directory"),
        (["--out", "file"], "file: is not an empty folder or one of this study; choose another --out"),
        (["--out", "full"], "full: is not an empty folder or one of this study; choose another --out"),
        (["--workers", "0"], "--workers: found 0, must be from 1 to 1,024"),
        (["--workers", "5000"], "--workers: found 5000, must be from 1 to 1,024"),
        (["--workers", "two"], 'Invalid value for --workers: unable to convert "two" into int.'),
        (["--seed", "-1"], "study.toml: seed: found -1; input should be greater than or equal to 0"),
        (["--worker", "1"], "Unknown option: --worker. Did you mean --workers?"),
    ],
)
def test_run_refuses_folders_and_options(cli, tiny, arguments, words):
    Path("file").write_text("mine")
    Path("full").mkdir()
    Path("full/thesis.tex").write_text("mine")
    assert_is_one_line(cli("run", tiny, *arguments), words)
    assert sorted(path.name for path in Path.cwd().rglob("*")) == ["file", "full", "thesis.tex"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_a_folder_without_write_permission_is_refused(cli, tiny):
    Path("locked").mkdir(mode=0o555)
    assert_is_one_line(cli("run", tiny, "--out", "locked"), "locked: cannot be written: Permission denied")
    assert_is_one_line(cli("run", tiny, "--out", "locked/below"), "locked/below: cannot be written: Permission denied")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--runs", "0"], "--runs: found 0, must be from 1 to 1,000,000"),
        (["--runs", "2000000"], "--runs: found 2000000, must be from 1 to 1,000,000"),
        (["--runs", "many"], 'Invalid value for --runs: unable to convert "many" into int.'),
        (["--set", "layout"], "--set: found 'layout', must be KEY=VALUE"),
        (["--set", "layot=cross-8"], "--set: layot: unknown key; allowed: across_mm, aligned_share, "),
        (["--set", "layout=cross-9"], "design.layout: found 'cross-9', must be one of pair, cross-96, "),
        (["--set", "antenna=1x1"], "design.antenna: antenna is '1x1', must be one of 30x30, "),
        (
            ["--set", "antenna=30x30"],
            "prices.toml: per_robot.antenna: no price for antenna '30x30', the list has 60x60, ",
        ),
        (["--set", "pattern=hexagonal"], "design.pattern: found 'hexagonal'; input should be 'square', 'triangular', "),
        (["--set", "tags_per_m2=-3"], "design.tags_per_m2: found -3; input should be greater than 0"),
        (["--set", "tags_per_m2=1e12"], "design.tags_per_m2: found 1000000000000.0; input should be less than or"),
        (["--set", "n_particles=1"], "mcl.n_particles: found 1; input should be greater than or equal to 2"),
        (["--set", "reinitialize=maybe"], "mcl.reinitialize: found 'maybe'; input should be a valid boolean"),
        (["--set", "start=lost"], "scenario.start: found 'lost'; input should be 'known' or 'unknown'"),
        (
            ["--set", "estimator=kalman"],
            "study.toml: estimator: found 'kalman'; input should be 'mcl', 'pmg', 'particle_filter'",
        ),
        (
            ["--set", "reader=mine"],
            "study.toml: robot.reader: reader is 'mine', must be one of hf-anticollision, goett",
        ),
        (
            ["--set", "polling=random"],
            "world.polling: found 'random'; input should be 'common', 'staggered' or 'multip",
        ),
        (
            ["--set", "world.odometry.track_mm=300"],
            "world.odometry: track_mm has no meaning for model 'omnidirectional', only noise_mm_per_s, noise_rad_per_s",
        ),
        (
            ["--set", "reader=goetting-hg-g-98830", "--set", "tags_per_m2=400"],
            "study.toml: design: reader goetting-hg-g-98830 must never see two tags at once; antenna 60x60 sees tags up"
            " to 60 mm apart, those of pattern square with 400 tags/m2 lie 50 mm apart",
        ),
    ],
)
def test_evaluate_refuses_numbers_and_settings(cli, tiny, arguments, words):
    assert_is_one_line(cli("evaluate", tiny, *arguments), words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["chekc", "x"], 'Unknown command "chekc". Did you mean "check"?'),
        (["check"], "parameter --study requires an argument"),
        (["report", "nowhere"], "nowhere/result.json: cannot be read: No such file or directory"),
    ],
)
def test_commands_that_make_no_sense_are_one_line(cli, arguments, words):
    assert_is_one_line(cli(*arguments), words)


def test_a_damaged_run_table_is_one_line(cli, tiny, finished):
    shutil.copytree(finished, "out")
    Path("out/runs.sqlite").write_bytes(b"nonsense" * 1000)
    assert_is_one_line(cli("run", tiny, "--out", "out"), "out/runs.sqlite: cannot be used: file is not a database")


def test_another_study_s_folder_is_refused(cli, tiny, finished):
    before = (finished / "result.json").stat().st_mtime_ns
    assert_is_one_line(cli("run", tiny, "--out", finished, "--seed", "8"), "holds another study, or this one before")
    assert (finished / "result.json").stat().st_mtime_ns == before
