"""A result folder is read whole and checked, and what is wrong with it is one line."""

import json

import numpy as np
import pytest

from rfiddesign.errors import StudyError
from rfiddesign.report.contents import read_contents, read_plan, read_tags


@pytest.fixture
def broken(synthetic, tmp_path):
    """A folder to damage."""
    synthetic.write_folder(tmp_path, robots=(5, 200))
    return tmp_path


def test_a_good_folder_is_read_as_it_was_written(broken):
    contents = read_contents(broken)
    for answer in contents.answers:
        assert len(answer.tags_mm) == answer.chosen.n_tags == contents.design(answer.record.winner).n_tags
        assert {trace.n_robots for trace in answer.traces} == {answer.record.n_robots}
    assert contents.plan.drivable.area == pytest.approx(14e3 * 9e3, rel=1e-12)


@pytest.mark.parametrize("name", ["result.json", "design.json", "tags.csv", "plan.geojson", "robots-200/design.json"])
def test_a_missing_file_is_named(broken, name):
    (broken / name).unlink()
    with pytest.raises(StudyError) as caught:
        read_contents(broken)
    assert str(caught.value).startswith(str(broken / name))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["result.json", "design.json", "tags.csv", "plan.geojson", "traces.json"])
@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe\x00", b"[1, 2]", b'{"features": [{"properties": null}]}'])
def test_a_corrupted_file_is_named(broken, name, content):
    (broken / name).write_bytes(content)
    with pytest.raises(StudyError) as caught:
        read_contents(broken)
    assert str(caught.value).startswith(str(broken / name))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("row", ["1,2", "1,x,3", "1,2,nan", "1,inf,3"])
def test_a_bad_row_of_tags_is_an_error(tmp_path, row):
    path = tmp_path / "tags.csv"
    path.write_text(f"id,x_mm,y_mm\n0,1.0,2.0\n{row}\n")
    with pytest.raises(StudyError):
        read_tags(path)


def test_tags_are_positions_in_millimetres(tmp_path):
    path = tmp_path / "tags.csv"
    path.write_text("id,x_mm,y_mm\n0,1.5,-2\n1,3,4e3\n")
    np.testing.assert_array_equal(read_tags(path), [[1.5, -2], [3, 4000]])


def test_a_plan_needs_both_areas(tmp_path):
    square = {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]}
    feature = {"type": "Feature", "properties": {"role": "drivable"}, "geometry": square}
    path = tmp_path / "plan.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    with pytest.raises(StudyError, match="navigable"):
        read_plan(path)


def test_cost_lines_must_add_up_to_the_price(synthetic, tmp_path):
    result = synthetic.write_folder(tmp_path, robots=(5,))
    answer = result.answers[0].model_copy(update={"cost_lines": result.answers[0].cost_lines[1:]})
    (tmp_path / "result.json").write_text(result.model_copy(update={"answers": [answer]}).model_dump_json())
    with pytest.raises(StudyError, match="the winner costs"):
        read_contents(tmp_path)


def test_a_decision_about_an_unknown_design_is_an_error(synthetic, tmp_path):
    result = synthetic.write_folder(tmp_path, robots=(5,))
    (tmp_path / "result.json").write_text(result.model_copy(update={"designs": result.designs[3:]}).model_dump_json())
    with pytest.raises(StudyError, match="has no design"):
        read_contents(tmp_path)
