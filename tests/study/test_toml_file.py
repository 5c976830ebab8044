"""TOML files from users: whatever is in them, the answer is a dictionary or one line."""

from decimal import Decimal

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.study.config import StudyFile
from rfiddesign.study.price_config import PriceFile
from rfiddesign.study.toml_file import MAX_BYTES, read_toml, validate


def problem(call, *arguments) -> str:
    with pytest.raises(StudyError) as caught:
        call(*arguments)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"a = = 3", "is not TOML: Invalid value"),
        (b'a = "\xff"', "is not UTF-8 text"),
        (b"\x00\x01\x02", "is not TOML"),
        (b"a = " + b"9" * 5000, "is not TOML"),
        (b"a = " + b"[" * 50_000, "is not TOML"),
        (b"a = 1\n" * 2, "is not TOML: Cannot overwrite a value"),
        (b"#" * (MAX_BYTES + 1), "is too large, at most 1,000,000 bytes are allowed"),
    ],
)
def test_what_is_no_toml_is_one_line_that_names_the_file(tmp_path, content, words):
    path = tmp_path / "study.toml"
    path.write_bytes(content)
    assert problem(read_toml, path).startswith(f"{path}: {words}")


def test_a_decimal_beyond_all_exponents_is_one_line(tmp_path):
    path = tmp_path / "prices.toml"
    path.write_text("a = 1e9999999999999999999999")
    assert problem(read_toml, path, Decimal).startswith(f"{path}: is not TOML")


def test_a_missing_file_and_a_folder_are_one_line(tmp_path):
    assert problem(read_toml, tmp_path / "no.toml") == f"{tmp_path}/no.toml: cannot be read: No such file or directory"
    assert problem(read_toml, tmp_path) == f"{tmp_path}: cannot be read: Is a directory"


def test_windows_line_ends_are_read(tmp_path):
    (tmp_path / "a.toml").write_bytes(b'a = 1\r\nb = "x"\r\n')
    assert read_toml(tmp_path / "a.toml") == {"a": 1, "b": "x"}


def test_decimals_keep_their_digits_if_asked(tmp_path):
    (tmp_path / "a.toml").write_text("a = 0.10\nb = 3")
    assert read_toml(tmp_path / "a.toml", Decimal) == {"a": Decimal("0.10"), "b": 3}


@pytest.mark.parametrize(
    ("data", "line"),
    [
        ({"sed": 1}, "sed: unknown key; did you mean seed? allowed: "),
        ({"scenario": {"pitch_cm": 3}}, "scenario.pitch_cm: unknown key; allowed: aligned_share, drive, dt_s, "),
        ({"mcl": {"odometry": {"noise_mm": 3.0}}}, "noise_mm: unknown key; did you mean noise_mm_per_s?"),
        ({"seed": 1.5}, "seed: found 1.5; input should be a valid integer"),
        ({"seed": True}, "seed: found True; input should be a valid integer"),
        ({"seed": 16**5000}, "seed: found a number of thousands of digits; "),
        ({"fleet": {"robots": [5, 0]}}, "fleet.robots.1: found 0; input should be greater than or equal to 1"),
        ({"fleet": {"robots": [5, 5]}}, "fleet: robots is [5, 5], must not name a size twice"),
        (
            {"search": {"alpha_refute": 0.7}},
            "search.alpha_refute: found 0.7; input should be less than or equal to 0.5",
        ),
        ({"search": {"limit_factors": [1.0]}}, "search: limit_factors is [1.0], must not name a factor twice, nor 1"),
        ({"search": {"fail_probability": 0.96}}, "search: fail_probability must be below hold_probability"),
        ({"floor": {}}, "floor: needs exactly one of map and rectangle_m"),
        ({"prices": "a\0b"}, "prices: found 'a\\x00b'; string should match pattern"),
        ({"requirement": {}}, "requirement: needs at least one of position_mean_mm, "),
        ({"scenario": {"duration_s": float("inf")}}, "scenario.duration_s: found inf; input should be less than"),
        ({"scenario": {"duration_s": float("nan")}}, "scenario.duration_s: found nan; input should be "),
        ({"scenario": {"start": "x" * 500}}, "xxx...; input should be 'known' or 'unknown'"),
    ],
)
def test_the_first_fault_is_told_with_key_value_and_what_is_allowed(tmp_path, data, line):
    complete = {
        "title": "t",
        "floor": {"rectangle_m": [1.0, 1.0]},
        "requirement": {"position_max_mm": 1.0},
        "space": {"layout": ["a"], "antenna": ["a"], "pattern": ["square"], "tags_per_m2": [1.0]},
    }
    validate(StudyFile, complete, tmp_path)
    found = problem(validate, StudyFile, complete | data, tmp_path)
    assert line in found
    assert len(found) < 700


@pytest.mark.parametrize("value", ["42.00", True, Decimal("-1"), Decimal("nan"), Decimal("Infinity"), Decimal("1e-7")])
def test_a_price_is_a_number_of_at_most_six_decimals_and_not_negative(tmp_path, value):
    assert "per_project.price: found" in problem(validate, PriceFile, price_data(value), tmp_path)


@pytest.mark.parametrize("value", [0, 12, Decimal("0.10"), Decimal("1e3"), Decimal("0.000001")])
def test_prices_are_exact(tmp_path, value):
    found = validate(PriceFile, price_data(value), tmp_path).per_project.price
    assert isinstance(found, Decimal)
    assert found == value


def price_data(value: object) -> dict:
    entry = {"price": 1, "source": "assumption"}
    return {
        "currency": "EUR",
        "per_robot": {
            "reader": entry,
            "cabling": entry,
            "antenna": {"60x60": entry},
            "controller": [entry | {"channels": 4}],
        },
        "per_tag": {"tag": entry, "laying": entry},
        "per_m2": {"covering": entry, "survey": entry},
        "per_project": {"price": value, "source": "assumption"},
    }
