"""What comes out of a study: its records, and the folder they are kept in."""

from rfiddesign.results.study_result import StudyResult

__all__ = ["StudyResult"]
