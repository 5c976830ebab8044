"""HiGHS without a word on standard output and with the same answer everywhere."""

import ctypes
import os
import warnings
from functools import cache

import cvxpy as cp
import highspy


def quiet_highs(**options: object) -> highspy.Highs:
    """Return a solver with these options of HiGHS, silent and on one thread.

    The number of threads stays as it is: HiGHS refuses to run once it has been asked for another one before.
    """
    _print_banner_unseen()
    solver = highspy.Highs()
    solver.silent()
    for option, value in {"parallel": "off", "random_seed": 1, **options}.items():
        solver.setOptionValue(option, value)
    return solver


def solve_with_highs(model: cp.Problem, **options: object) -> None:
    """Solve a model of cvxpy in place; limits by `options` of HiGHS, and `model.status` tells how it ended.

    Raises
    ------
    cvxpy.SolverError : if it ends without any statement, as at a limit before a first solution.
    """
    _print_banner_unseen()
    with warnings.catch_warnings():
        # Said of every search that ends at a limit.
        warnings.filterwarnings("ignore", message="Solution may be inaccurate")
        model.solve(solver=cp.HIGHS, parallel="off", random_seed=1, **options)


@cache
def _print_banner_unseen() -> None:
    """Let HiGHS print its banner, as the first of a process does whatever its options, to nowhere."""
    libc = ctypes.CDLL(None)
    libc.fflush(None)
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        highspy.Highs()
        libc.fflush(None)
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
