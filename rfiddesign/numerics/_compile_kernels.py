"""How kernels are compiled.

All are kept on disk, release the interpreter's lock and, like C, give infinity where they divide by zero: a kernel
raises nothing.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from numba import njit
from numba.core import event, types
from numba.core.dispatcher import Dispatcher

from rfiddesign.numerics.stale_code import forget_stale_code

forget_stale_code()


def _one_for_all_numbers(decorate: Callable) -> Callable:
    """A decorator whose kernels are compiled once for all whole numbers that other kernels write out in calls of them.

    To numba each such number is a type of its own, for which it would compile a kernel, and all below it, again.
    """

    def decorated(function: Callable) -> Dispatcher:
        compiled = decorate(function)
        of_types = compiled.get_call_template
        compiled.get_call_template = lambda args, kws: of_types(
            [types.unliteral(arg) for arg in args], {name: types.unliteral(arg) for name, arg in kws.items()}
        )
        return compiled

    return decorated


kernel = _one_for_all_numbers(njit(cache=True, nogil=True, error_model="numpy"))
# For kernels that allocate nothing, called in an inner loop: numba counts in and out every array that a function is
# given, about 5 ns each, unless it may not allocate.
leaf_kernel = _one_for_all_numbers(njit(cache=True, nogil=True, error_model="numpy", _nrt=False))
# For formulas of a line or two that become part of their callers.
inline_kernel = njit(cache=True, nogil=True, error_model="numpy", inline="always")


@contextmanager
def told_of_compilation(tell: Callable[[str | None], None]) -> Iterator[None]:
    """Call `tell` with the name of each kernel that begins to be compiled, and with None when all is compiled again.

    Kernels that are on disk are not compiled.  What a kernel calls is compiled within it and not told.
    """

    class Teller(event.Listener):
        depth = 0

        def on_start(self, event):
            self.depth += 1
            if self.depth == 1:
                tell(event.data["dispatcher"].py_func.__name__)

        def on_end(self, event):
            self.depth -= 1
            if self.depth == 0:
                tell(None)

    with event.install_listener("numba:compile", Teller()):
        yield
