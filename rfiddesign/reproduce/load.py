"""Find and read a reproduction."""

from pathlib import Path

from rfiddesign.errors import StudyError
from rfiddesign.reproduce.config import FLOOR, ExpectedFile
from rfiddesign.reproduce.kinds import KINDS
from rfiddesign.reproduce.reproduction import Reproduction
from rfiddesign.study.toml_file import read_toml, validate

FILE_NAME, EXPECTED_NAME = "study.toml", "expected.toml"
STUDIES = "studies"


def load_reproduction(name: str) -> Reproduction:
    """Read the reproduction in the folder (or of the study file) `name`, or in studies/`name` here or by the package.

    Raises
    ------
    StudyError : for anything missing, unknown or out of bounds in its files.
    """
    folder = _folder_of(name)
    path = folder / FILE_NAME
    data = read_toml(path)
    if not {"rows", "grids", "kind"} & data.keys():
        raise StudyError("is no reproduction (it has no rows); use `rfiddesign run`", file=path)
    named = data.get("kind", FLOOR)
    if not isinstance(named, str) or named not in KINDS:
        raise StudyError(f"found {named!r}, must be one of {', '.join(KINDS)}", file=path, key="kind")
    kind = KINDS[named]
    file = validate(kind.File, data, path)
    expected_path = folder / EXPECTED_NAME
    expected = validate(ExpectedFile, read_toml(expected_path), expected_path) if expected_path.exists() else None
    return kind.prepared(Reproduction(path, file, expected or ExpectedFile()))


def _folder_of(name: str) -> Path:
    beside = Path(__file__).parents[2] / STUDIES
    given = Path(name)
    candidates = [given.parent if given.name == FILE_NAME else given, Path(STUDIES) / name, beside / name]
    for folder in candidates:
        if (folder / FILE_NAME).is_file():
            return folder
    known = sorted({path.parent.name for root in (Path(STUDIES), beside) for path in root.glob(f"*/{EXPECTED_NAME}")})
    raise StudyError(
        f"found neither {name}/{FILE_NAME} nor {STUDIES}/{name}/{FILE_NAME}"
        + (f"; known: {', '.join(known)}" if known else ""),
        file="reproduce",
    )
