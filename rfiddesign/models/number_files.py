"""Tables of numbers as CSV files: a header of names, then one row of numbers per line, each within its bounds."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rfiddesign.errors import StudyError
from rfiddesign.results.folder import replacing

# In memory a file takes several times its size while it is read.
MAX_BYTES = 200_000_000
#: Largest values: a century in seconds, the largest floor, whole numbers of 32 bits.
LARGEST_S, LARGEST_MM, LARGEST_RAD, LARGEST_WHOLE = 4e9, 5e6, 1e6, 2**31 - 1


@dataclass(frozen=True)
class Column:
    """A column: its name, the largest size of its values, and the decimals to write; None: whole numbers from 0."""

    name: str
    largest: float
    decimals: int | None = None


def read_numbers(path: str | Path, columns: Sequence[Column]) -> np.ndarray:
    """The numbers of a file, (n, columns).

    Raises
    ------
    StudyError : naming file, line and column, if it is missing, too large or not what it should be.
    """
    path, header = Path(path), ",".join(column.name for column in columns)
    try:
        if path.stat().st_size > MAX_BYTES:
            raise StudyError(f"has {path.stat().st_size:,} bytes, at most {MAX_BYTES:,} are allowed", file=path)
        lines = path.read_text(encoding="ascii").splitlines()
    except OSError as error:
        raise StudyError(f"cannot be read: {error.strerror}", file=path) from None
    except UnicodeDecodeError:
        raise StudyError("is not plain text", file=path) from None
    if not lines or lines[0].strip() != header:
        raise StudyError(f"begins with {(lines or [''])[0][:60]!r}, must begin with {header}", file=path)
    rows = lines[1:]
    if not rows:
        return np.empty((0, len(columns)))
    try:
        table = np.loadtxt(rows, delimiter=",", comments=None, ndmin=2)
    except (ValueError, OverflowError):
        table = None
    if table is None or table.shape != (len(rows), len(columns)):
        number = next((i for i, row in enumerate(rows) if not _is_row(row, len(columns))), 0)
        raise StudyError(f"line {number + 2} is {rows[number][:60]!r}, must be {len(columns)} numbers", file=path)
    for column, values in zip(columns, table.T, strict=True):
        is_wrong = ~(np.abs(values) <= column.largest)
        if column.decimals is None:
            is_wrong |= (values != np.floor(values)) | (values < 0)
        if np.any(is_wrong):
            number = int(np.flatnonzero(is_wrong)[0])
            kind = "a whole number from 0 to" if column.decimals is None else "a number of size at most"
            raise StudyError(
                f"line {number + 2}: {column.name} is {values[number]:g}, must be {kind} {column.largest:,.0f}",
                file=path,
            )
    return table


def write_numbers(path: str | Path, columns: Sequence[Column], table: np.ndarray) -> None:
    """Write a table (n, columns) so that `read_numbers` reads it, rounded to each column's decimals."""
    row = ",".join(f"{{:.{column.decimals or 0}f}}" for column in columns).format
    with replacing(Path(path)) as temporary, temporary.open("w", encoding="ascii", newline="\n") as stream:
        stream.write(",".join(column.name for column in columns) + "\n")
        stream.writelines(row(*values) + "\n" for values in np.asarray(table, float).tolist())


def _is_row(row: str, n: int) -> bool:
    try:
        return len([float(cell) for cell in row.split(",")]) == n
    except ValueError:
        return False
