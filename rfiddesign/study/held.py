"""What the folder of a finished study holds, read and checked to be what it should be."""

import json
from dataclasses import dataclass
from pathlib import Path

from rfiddesign.cost import PriceList
from rfiddesign.errors import StudyError
from rfiddesign.metrics import RunMetrics
from rfiddesign.optimize import TestPlan
from rfiddesign.results import folder as files
from rfiddesign.results.certificate import Certificate
from rfiddesign.results.study_result import StudyResult
from rfiddesign.study.certificate import PRICES
from rfiddesign.study.config import StudyFile
from rfiddesign.study.criteria import Criteria
from rfiddesign.study.load import criteria_of
from rfiddesign.study.storage import RunTable


@dataclass(frozen=True)
class Held:
    """What a folder holds, read and checked to be what it should be."""

    folder: Path
    certificate: Certificate
    result: StudyResult
    file: StudyFile
    prices: PriceList
    criteria: Criteria
    runs: dict[int, tuple[list[RunMetrics], ...]]
    study_hash: str | None

    @property
    def plan(self) -> TestPlan:
        """The test as the study file declares it."""
        search = self.file.search
        return TestPlan(
            len(self.certificate.candidates), search.hold_probability, search.fail_probability, search.alpha_refute,
            search.alpha_certify, search.max_runs, criteria=self.criteria.declared(),
        )  # fmt: skip


def read_held(folder: Path) -> Held:
    """Read the folder of a finished study; StudyError if a file is missing or not what it should be."""
    certificate = files.read_record(folder / files.CERTIFICATE, Certificate)
    result = files.read_record(folder / files.RESULT, StudyResult)
    path = folder / files.STUDY
    try:
        resolved = json.loads(path.read_bytes())
        file = StudyFile.model_validate_json(json.dumps(resolved["study"]))
        held_hash = resolved["hash"]
    except OSError as error:
        raise StudyError(f"cannot be read: {error.strerror}", file=path) from None
    except (ValueError, LookupError, TypeError, RecursionError):
        raise StudyError("is not the resolved study of this version of the program", file=path) from None
    try:
        prices = PRICES.validate_json(json.dumps(certificate.prices))
    except ValueError:
        raise StudyError("is not a price list", file=folder / files.CERTIFICATE, key="prices") from None
    criteria = criteria_of(file)
    if not (folder / files.RUNS).is_file():
        raise StudyError("is missing", file=folder / files.RUNS)
    with RunTable(folder / files.RUNS) as table:
        stored = table.runs()
    numbers = {design for _, design in stored}
    runs = {number: tuple(stored.get((i, number), []) for i in range(len(criteria.scenarios))) for number in numbers}
    return Held(folder, certificate, result, file, prices, criteria, runs, held_hash)
