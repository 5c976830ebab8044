"""Whose a folder of results is: claimed by a study's hash before the first run, and refused to every other."""

import json
from pathlib import Path
from typing import Any

from rfiddesign.errors import StudyError
from rfiddesign.results import folder as files


def is_begun(out: Path, digest: str) -> bool:
    """Whether the folder holds the very study of that hash; StudyError if it holds anything else."""
    try:
        if (out / files.STUDY).exists():
            if _held_hash(out / files.STUDY) != digest:
                raise StudyError("holds another study, or this one before a change; choose another --out", file=out)
            return True
        # A process killed while it claimed the folder leaves a hidden temporary file.
        if out.exists() and (not out.is_dir() or any(not path.name.startswith(".") for path in out.iterdir())):
            raise StudyError("is not an empty folder or one of this study; choose another --out", file=out)
    except OSError as error:
        raise StudyError(f"cannot be read: {error.strerror}", file=out) from None
    return False


def claim_folder(out: Path, digest: str, resolved: dict[str, Any]) -> None:
    """Make the folder and write what was resolved of the study, beside its hash."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        files.write_text(out / files.STUDY, json.dumps({"hash": digest} | resolved, indent=1) + "\n")
    except OSError as error:
        raise StudyError(f"cannot be written: {error.strerror}", file=out) from None


def _held_hash(path: Path) -> str | None:
    try:
        return json.loads(path.read_text(encoding="utf-8")).get("hash")
    except (ValueError, AttributeError, RecursionError):
        return None
