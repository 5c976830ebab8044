"""Files of a result folder appear whole or not at all."""

import pytest
from pydantic import BaseModel

from rfiddesign.errors import StudyError
from rfiddesign.results.folder import answer_folder, read_record, replacing, write_record, write_text


class Tag(BaseModel):
    name: str
    x_mm: float


def test_a_record_is_read_as_it_was_written(tmp_path):
    path = tmp_path / "tag.json"
    write_record(path, Tag(name="ü", x_mm=0.1))
    assert read_record(path, Tag) == Tag(name="ü", x_mm=0.1)
    assert path.read_bytes().endswith(b"}\n")


def test_text_is_utf8_with_plain_newlines_and_readable_by_all(tmp_path):
    write_text(tmp_path / "a.txt", "ü\n")
    assert (tmp_path / "a.txt").read_bytes() == b"\xc3\xbc\n"
    assert (tmp_path / "a.txt").stat().st_mode & 0o777 == 0o644


@pytest.mark.parametrize("interruption", [ValueError, KeyboardInterrupt])
def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(tmp_path, interruption):
    path = tmp_path / "a.txt"
    write_text(path, "old")

    def write_half() -> None:
        with replacing(path) as temporary:
            temporary.write_text("ne")
            raise interruption

    with pytest.raises(interruption):
        write_half()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (None, "cannot be read: No such file or directory"),
        (b"{", "Invalid JSON"),
        (b'{"name": "a"}', "x_mm: Field required"),
        (b'{"name": "\xff", "x_mm": 1}', "Invalid JSON"),
    ],
)
def test_a_broken_record_is_one_line_with_file_and_key(tmp_path, content, problem):
    path = tmp_path / "tag.json"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(StudyError, match=problem) as caught:
        read_record(path, Tag)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_first_answer_lies_in_the_folder_itself_and_the_others_below(tmp_path):
    assert answer_folder(tmp_path, 5, is_first=True) == tmp_path
    assert answer_folder(tmp_path, 200, is_first=False) == tmp_path / "robots-200"
