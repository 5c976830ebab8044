"""The folder of a study's results: names of its files, and how they are written whole or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from rfiddesign.errors import StudyError

RESULT = "result.json"
CERTIFICATE = "certificate.json"
STUDY = "study.json"
PROVENANCE = "provenance.json"
RUNS = "runs.sqlite"
TRACES = "traces.json"
COMPUTING = "computing.json"
PLAN = "plan.geojson"
ROUTES = "routes.json"
COST = "cost.csv"
DESIGN = "design.json"
PLACEMENTS = "placements.json"
TAGS = "tags.csv"
REPORT = "report.html"
REGIMES = "regimes.json"
REGIMES_CSV = "regimes.csv"
SHELVES = "shelves.json"
SHELVES_CSV = "shelves.csv"
SHELF_RUNS = "shelf-runs.sqlite"
EXPLORATION = "exploration.json"
PARETO = "pareto.json"
EXPLORE_RUNS = "explore.sqlite"
FRONT_RUNS = "front.sqlite"
COMPARISON = "comparison.json"
COMPARISON_CSV = "comparison.csv"
SURVEY = "survey.json"
SURVEYED_TAGS = "surveyed_tags.csv"
FIGURES = "figures"

#: What a study may write once beside its answers, the same on every machine.
BESIDE_ANSWERS = (TRACES, PLAN, PLACEMENTS, REGIMES, SHELVES, ROUTES, SURVEY, SURVEYED_TAGS, EXPLORATION, PARETO)

MAX_BYTES = 200_000_000

Model = TypeVar("Model", bound=BaseModel)


def answer_folder(folder: Path, n_robots: int, *, is_first: bool) -> Path:
    """Where cost, design and tags of an answer lie: the folder itself for the first, a subfolder for the others."""
    return folder if is_first else folder / f"robots-{n_robots}"


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path beside `path` that takes its place when the block ends without an error."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=path.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def write_text(path: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def read_record(path: Path, model: type[Model]) -> Model:
    """Read a record from its JSON file; StudyError if it is missing, too large or not what it should be."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise StudyError(f"has {path.stat().st_size:,} bytes, at most {MAX_BYTES:,} are allowed", file=path)
        return model.model_validate_json(path.read_bytes())
    except OSError as error:
        raise StudyError(f"cannot be read: {error.strerror}", file=path) from None
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise StudyError(first["msg"], file=path, key=key or None) from None


def write_record(path: Path, record: BaseModel) -> None:
    """Write a record as JSON, indented, ending in a newline."""
    write_text(path, record.model_dump_json(indent=1) + "\n")
