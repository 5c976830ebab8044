"""The JSON Schema that editors read is the one that studies are checked against."""

from rfiddesign.study.config import SCHEMA_PATH
from rfiddesign.study.schema import schema_text


def test_the_committed_schema_is_that_of_the_code():
    assert SCHEMA_PATH.read_text(encoding="utf-8") == schema_text(), "run python -m rfiddesign.study.schema"
