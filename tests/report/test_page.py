"""The report is one page that says the answer first, loads nothing and trusts no text."""

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.report import write_report
from rfiddesign.results.folder import read_record
from rfiddesign.results.study_result import StudyResult


class Outline(HTMLParser):
    """Collects ids, addresses that a browser would follow or load, and the visible text in order."""

    def __init__(self):
        super().__init__()
        self.ids, self.addresses, self.tags, self.text = [], [], [], []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        for name, value in attributes:
            if name == "id":
                self.ids.append(value)
            if name in ("src", "href", "xlink:href", "data", "action", "poster", "srcset"):
                self.addresses.append(value)

    def handle_data(self, data):
        if self.tags[-1:] != ["style"]:
            self.text.append(data)


@pytest.fixture(scope="module")
def html(folder) -> str:
    return (folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def outline(html) -> Outline:
    parser = Outline()
    parser.feed(html)
    return parser


def test_the_answer_comes_before_everything_else(folder, outline):
    """Within the first few hundred letters stand both prices, how many drives passed and the requirement."""
    text = " ".join(" ".join(outline.text).split())
    start = text.index("A drive passes if")
    first = text[start : start + 1200]
    result = read_record(folder / "result.json", StudyResult)
    for answer in result.answers:
        price = f"EUR {answer.winner.cost_cents // 100:,}.{answer.winner.cost_cents % 100:02d}"
        assert price in first
        assert f"certified: {answer.winner.n_passed} of {answer.winner.n_runs} drives passed" in first
    assert "position error is at most 20 mm (95th percentile)" in first
    assert "at most 2.5 %" in first
    assert first.index("drives passed") < first.index("Fleets compared")


def test_text_of_the_study_is_escaped(html, outline):
    """A title that carries a script shows as text and does not become one."""
    assert "script" not in outline.tags
    assert "<script" not in html
    assert "&lt;script&gt;alert(" in html


def test_the_page_loads_nothing(html, outline):
    """Addresses lead into the page or hold their data themselves; styles import nothing."""
    assert outline.addresses
    assert all(address.startswith(("#", "data:image/png;base64,")) for address in outline.addresses)
    assert not re.search(r"@import|url\((?!#|['\"]?#)", html)
    assert not {"script", "iframe", "object", "embed", "link", "base", "form"} & set(outline.tags)


def test_ids_are_unique_and_references_find_their_target(html, outline):
    """Figures were drawn one by one; on one page their ids must not meet, and each reference must still hit."""
    assert len(outline.ids) == len(set(outline.ids))
    targets = {address[1:] for address in outline.addresses if address.startswith("#")}
    targets |= set(re.findall(r"url\(#([^)]+)\)", html))
    assert len(targets) > 50
    assert targets <= set(outline.ids)


def test_drawing_again_gives_the_same_bytes(folder):
    """The page, every figure and the cost tables do not depend on when they were drawn."""
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    write_report(folder)
    after = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert before == after


def test_every_figure_is_there_as_svg_and_png(folder):
    names = {path.stem for path in (folder / "figures").glob("*.svg")}
    assert names == {path.stem for path in (folder / "figures").glob("*.png")}
    per_answer = ("cost-against-error", "layout", "tags", "coverage", "blind-distance", "error-curves")
    expected = {f"{name}-robots-{n}" for name in per_answer for n in (5, 200)}
    assert names == expected | {"cost-split", "cost-against-limit"}
    for path in (folder / "figures").glob("*.png"):
        assert path.read_bytes().startswith(b"\x89PNG")


@pytest.mark.usefixtures("without_pictures")
def test_a_single_fleet_is_not_compared(synthetic, tmp_path):
    synthetic.write_folder(tmp_path, robots=(20,))
    html = write_report(tmp_path).read_text(encoding="utf-8")
    assert 'id="fleets"' not in html
    assert 'id="cost"' in html
    assert "20 robots: cheapest certified design" in html


def test_without_a_winner_the_page_says_only_what_is_known(synthetic, tmp_path):
    """No price, no layout, no promise about a design; but the claim, the tests and the floor."""
    synthetic.write_folder(tmp_path, has_winners=False)
    html = write_report(tmp_path).read_text(encoding="utf-8")
    assert html.count("No design certified") == 2
    assert "Every candidate was refuted." in html
    assert "No design that was a candidate keeps the limits in 95\u00a0% or more of drives." in html
    assert 'id="robot"' not in html
    assert not list(tmp_path.rglob("cost.csv"))
    assert (tmp_path / "figures" / "cost-against-error-robots-5.png").exists()


def test_a_folder_that_cannot_be_written_is_an_error_of_the_study(synthetic, tmp_path):
    synthetic.write_folder(tmp_path, robots=(5,))
    (tmp_path / "figures").write_text("a file where the folder should be")
    with pytest.raises(StudyError, match="cannot be written"):
        write_report(tmp_path)


def test_names_with_a_dollar_sign_are_drawn_as_they_are(synthetic, tmp_path):
    """Matplotlib would read them as formulas and fail on this one."""
    result = synthetic.write_folder(tmp_path, robots=(5,))
    odd = [design.model_copy(update={"layout": r"$\frac{ cross <b>"}) for design in result.designs]
    path = Path(tmp_path / "result.json")
    path.write_text(result.model_copy(update={"designs": odd}).model_dump_json())
    html = write_report(tmp_path).read_text(encoding="utf-8")
    assert r"$\frac{ cross &lt;b&gt;" in html
