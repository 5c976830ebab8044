"""The page of a comparison names every answer and saving, trusts no text, and says why there is none."""

import csv
import json
from html.parser import HTMLParser

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.report import write_comparison
from rfiddesign.report.figures import comparison_figure
from rfiddesign.report.figures.style import WIDTH_IN, in_style
from rfiddesign.results.comparison import Comparison, VariantAnswer, VariantRecord, WinnerRecord, saving
from rfiddesign.results.folder import write_record
from rfiddesign.results.study_result import Limit, RequirementRecord, TestRecord

HARM = '<script>alert("x")</script>'
TEST = TestRecord(
    hold_probability=0.95, fail_probability=0.9, alpha_refute=0.025, alpha_certify=0.025, n_designs=8, max_runs=500
)
LIMITS = RequirementRecord(limits=[Limit(metric="position_p95_mm", limit=30.0)], converged_within_s=None)
# Group, condition and price [cents] for 5 robots, or the claim that there is none.
ANSWERS = [
    ("mcl", "matched", 43_000_00),
    ("mcl", "10 mm", "none certified"),
    ("mcl", "20 mm", "none holds"),
    (f"={HARM}", "matched", 38_700_00),
    (f"={HARM}", "10 mm", 50_000_00),
    ("ekf", "matched", 47_300_00),
    ("ekf", "20 mm", "stopped by budget"),
]


def answer(outcome: int | str, n_robots: int, n_undecided: int = 0) -> VariantAnswer:
    winner = None
    if isinstance(outcome, int):
        winner = WinnerRecord(
            name="cross-8, 60x60, square, 64 tags/m2", estimator="mcl", layout="cross-8", antenna="60x60",
            pattern="square", tags_per_m2=64.0, n_readers=8, n_tags=1920, n_runs=140, n_passed=137,
            cost_cents=outcome * n_robots // 5,
        )  # fmt: skip
    return VariantAnswer(
        n_robots=n_robots, currency="EUR", claim="cheapest" if winner else outcome, claim_words="", winner=winner,
        lower_bound_cents=None if outcome == "none holds" else 41_000_00, n_undecided=n_undecided, n_runs_used=900,
        saving=None,
    )  # fmt: skip


def made_up(answers=ANSWERS, fleets=(5, 200), **changed) -> Comparison:
    """A comparison against the first group, with its savings."""
    variants = [
        VariantRecord(
            name=f"{group} {condition}", group=group, condition=condition, folder=f"v{i}",
            settings={"title": f'"{HARM}"'}, seed=7, prices="prices.toml",
            requirement=LIMITS, test=TEST, study_hash="0", n_runs=1000, answers=[answer(outcome, n) for n in fleets],
        )
        for i, (group, condition, outcome) in enumerate(answers)
    ]  # fmt: skip
    record = Comparison(version="0", study="s", title=f"Hall {HARM}", base=answers[0][0], variants=variants)
    for variant in variants:
        base = record.variant(record.base, variant.condition)
        for i, own in enumerate(variant.answers):
            if base is not None and base is not variant:
                variant.answers[i] = own.model_copy(update={"saving": saving(own, base.answers[i])})
    return record.model_copy(update=changed)


def drawn(folder, record: Comparison) -> str:
    write_record(folder / "comparison.json", record)
    return write_comparison(folder).read_text(encoding="utf-8")


class Text(HTMLParser):
    """Tags, addresses and text of a page."""

    def __init__(self, html: str):
        super().__init__()
        self.tags, self.addresses, self.words = [], [], []
        self.feed(html)
        self.text = " ".join(" ".join(self.words).replace("\u00a0", " ").split())

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.addresses += [value for name, value in attributes if name in ("src", "href", "xlink:href")]

    def handle_data(self, data):
        self.words.append(data)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("comparison")
    drawn(path, made_up())
    return path


@pytest.fixture(scope="module")
def page(folder) -> Text:
    return Text((folder / "report.html").read_text(encoding="utf-8"))


def test_every_answer_and_saving_stands_on_the_page(page):
    for words in (
        "EUR 43,000.00",
        "saves EUR 4,300.00 (10 %) cross-8, 60x60, square, 64 tags/m² ; 8 readers per robot".replace(" ;", ";"),
        "costs EUR 4,300.00 more (10 %)",
        "saves EUR 172,000.00 (10 %)",
        "no saving: the base is not certified",
        "savings are against mcl in the same column",
    ):
        assert words in page.text, words


def test_where_nothing_is_certified_the_page_says_why(page):
    assert "none: every design refuted" in page.text
    assert "undecided: none certified, some without a verdict after 500 drives; whatever holds costs at least EUR" in (
        page.text
    )
    assert "undecided: the search ended before any design was certified" in page.text


def test_the_page_says_what_is_compared(page):
    assert "All variants have the seed 7 and thus the same drives" in page.text
    assert "All prices are of the same price list, prices.toml." in page.text
    assert "A saving is the difference of two certified answers" in page.text
    assert "of drives is at most 2.5 %; that this happened to one of the two of a saving, at most 5 %" in page.text


def test_other_seeds_price_lists_and_limits_are_told(tmp_path):
    record = made_up()
    changed = {"seed": 8, "prices": "dear.toml", "requirement": RequirementRecord(limits=[], converged_within_s=3.0)}
    variants = [record.variants[0].model_copy(update=changed), *record.variants[1:]]
    text = Text(drawn(tmp_path, record.model_copy(update={"variants": variants}))).text
    assert "The variants have different seeds (8 and 7)" in text
    assert "The variants have different price lists (dear.toml and prices.toml)" in text
    assert "The variants have different limits" in text


def test_text_of_the_study_is_escaped_and_the_page_loads_nothing(folder, page):
    assert "script" not in page.tags
    assert HARM in page.text
    assert "<script" not in (folder / "figures" / "prices.svg").read_text()
    within = [address for address in page.addresses if not address.startswith("#")]
    assert sorted(set(within)) == [f"v{i}/report.html" for i in range(len(ANSWERS))]


def test_the_table_is_exact_and_no_cell_of_it_is_a_formula(folder):
    rows = list(csv.DictReader((folder / "comparison.csv").open(encoding="utf-8")))
    assert len(rows) == 2 * len(ANSWERS)
    assert [row["price"] for row in rows[:4]] == ["43000.00", "", "", "38700.00"]
    assert [row["saving"] for row in rows[:7]] == ["", "", "", "4300.00", "", "-4300.00", ""]
    assert rows[3]["group"] == f"'={HARM}"
    assert not [cell for row in rows for cell in row.values() if cell.startswith(("=", "@", "+"))]
    assert rows[1]["claim"] == "none certified"


def test_seconds_are_those_of_the_variants_sessions(tmp_path):
    for i, n_before in ((0, 0), (1, 321)):
        (tmp_path / f"v{i}").mkdir()
        session = {"wall_s": 12.34, "workers": 2, "runs_simulated": 5, "runs_stored_before": n_before, "out": "x"}
        (tmp_path / f"v{i}" / "provenance.json").write_text(json.dumps(session))
    text = Text(drawn(tmp_path, made_up())).text
    assert "12.3 s after 321 drives" in text
    assert "All 7,000 24.7 s" in text
    rows = list(csv.DictReader((tmp_path / "comparison.csv").open(encoding="utf-8")))
    assert [row["seconds"] for row in rows[:3]] == ["12.3", "12.3", ""]


def test_drawing_again_gives_the_same_bytes(folder):
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    write_comparison(folder)
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize(
    ("answers", "fleets"),
    [
        (ANSWERS, (5, 200)),
        ([("a", "", 1_000_00)], (1,)),
        ([("a", "", "none holds")], (1,)),
        ([("a", "", 1_000_00), ("b", "", 1_000_50)], (1,)),
        ([(f"{i} {'long ' * 11}", f"{j} {'words ' * 9}", 10 ** (4 + i + j)) for i in range(4) for j in range(9)], (1,)),
        ([("x" * 60, "y" * 60, 5_00), ("$\\frac{", "", 7_00)], (1, 2, 3)),
    ],
)
def test_nothing_sticks_out_of_the_figure(answers, fleets):
    figure = comparison_figure(made_up(answers), list(fleets[:2]))
    with in_style():
        figure.draw_without_rendering()
        box = figure.get_tightbbox()
    assert figure.get_figwidth() == WIDTH_IN
    assert box.x0 >= -0.03
    assert box.y0 >= -0.03
    assert box.x1 <= figure.get_figwidth() + 0.03
    assert box.y1 <= figure.get_figheight() + 0.03
    texts = figure.findobj(lambda artist: hasattr(artist, "get_fontsize"))
    assert min(text.get_fontsize() for text in texts if text.get_text()) >= 8.5


def test_figures_of_many_fleets_are_split(tmp_path):
    answers = [(f"group {i}", "", 1_000_00 + i) for i in range(25)]
    drawn(tmp_path, made_up(answers, fleets=(5, 10, 20)))
    assert {path.stem for path in (tmp_path / "figures").glob("*.png")} == {"prices", "prices-2", "prices-3"}


@pytest.mark.parametrize("folder_name", ["", "..", "../elsewhere", "a/b", "/etc", ".hidden"])
def test_a_folder_outside_the_comparison_is_refused(tmp_path, folder_name):
    text = made_up().model_dump_json().replace('"folder":"v0"', f'"folder":"{folder_name}"')
    (tmp_path / "comparison.json").write_text(text)
    with pytest.raises(StudyError, match=r"comparison.json: variants.0.folder: "):
        write_comparison(tmp_path)


def test_two_variants_in_one_folder_are_refused(tmp_path):
    (tmp_path / "comparison.json").write_text(made_up().model_dump_json().replace('"folder":"v1"', '"folder":"v0"'))
    with pytest.raises(StudyError, match=r"comparison.json: variants: has two variants of the same folder"):
        write_comparison(tmp_path)
