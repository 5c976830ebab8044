"""The one error that a user's input may cause, worded for the user."""

from pathlib import Path


class StudyError(ValueError):
    """Bad input in a study: one line that names the file, the key, what was found and what is allowed.

    Parameters
    ----------
    problem : what is wrong, with the value found and what is allowed.
    file : the file at fault, if there is one.
    key : the dotted path of the key in that file, if there is one.
    """

    def __init__(self, problem: str, *, file: str | Path | None = None, key: str | None = None):
        self.file = None if file is None else str(file)
        self.key = key
        self.problem = " ".join(problem.split())
        super().__init__(": ".join(part for part in (self.file, self.key, self.problem) if part))
