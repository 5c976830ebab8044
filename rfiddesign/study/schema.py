"""The study file as JSON Schema, for editors: `python -m rfiddesign.study.schema` writes it anew."""

import json

from rfiddesign.study.config import SCHEMA_PATH, StudyFile


def schema_text() -> str:
    """JSON Schema of a study file."""
    return json.dumps(StudyFile.model_json_schema(), indent=1) + "\n"


if __name__ == "__main__":
    SCHEMA_PATH.write_text(schema_text(), encoding="utf-8")
