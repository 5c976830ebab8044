"""Studies: read, checked, run and saved."""

from rfiddesign.study.commands import check_study, coverage_of_study, evaluate_study
from rfiddesign.study.export import export_estimator
from rfiddesign.study.load import Study, load_study
from rfiddesign.study.run_study import run_study
from rfiddesign.study.run_variants import run_variants
from rfiddesign.study.stages import Stage
from rfiddesign.study.variants import variant_of

__all__ = [
    "Stage",
    "Study",
    "check_study",
    "coverage_of_study",
    "evaluate_study",
    "export_estimator",
    "load_study",
    "run_study",
    "run_variants",
    "variant_of",
]
