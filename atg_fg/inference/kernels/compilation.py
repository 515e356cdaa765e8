"""Whether loops are compiled, how, and who is told that it takes a moment."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from typing import Any, Final, TypeVar

import numpy as np

from atg_fg.core.errors import MissingDependencyError

_Function = TypeVar("_Function", bound=Callable[..., Any])

#: Environment variable that turns compiled filters off when it is ``0``: NumPy then computes what they would.
SWITCH: Final = "ATG_FG_KERNELS"

#: −1 for no index, and 0, in a compiled function. Literals have types of their own, for which callees are compiled
#: once more.
NONE: Final[Any] = np.int64(-1)
ZERO: Final[Any] = np.int64(0)

#: No one calls by a pointer what is compiled: a function for that would have to be compiled, too.
_OPTIONS: Final = {"cache": True, "error_model": "numpy", "no_cfunc_wrapper": True}

_tell: Callable[[], None] | None = None


@cache
def _is_installed() -> bool:
    return find_spec("numba") is not None


def are_wanted() -> bool:
    """Return whether filters are to be compiled: Numba is installed, and ``SWITCH`` does not say otherwise."""
    return os.environ.get(SWITCH) != "0" and _is_installed()


def tell_of_compilation(tell: Callable[[], None]) -> None:
    """Call a function before this process compiles its first loop; loops that are read from the cache do not count."""
    global _tell
    _tell = tell


def compiled(function: _Function) -> _Function:
    """Have Numba compile a function, and keep what it made beside the source: the next process compiles nothing.

    Raises:
        MissingDependencyError: Numba is not installed.
    """
    result: _Function = _numba().njit(**_OPTIONS)(function)
    return result


def compiled_within(function: _Function) -> _Function:
    """Have Numba compile a function as ``compiled`` does that compiled functions alone call, never Python.

    What Python would call it by takes a third of the time to compile.

    Raises:
        MissingDependencyError: Numba is not installed.
    """
    result: _Function = _numba().njit(no_cpython_wrapper=True, **_OPTIONS)(function)
    return result


def written_out(function: _Function) -> _Function:
    """Have Numba take the lines of a function into the compiled one that calls it, in place of compiling it by itself.

    It is for long functions with one caller: what a function calls is compiled once more with each that calls it.

    Raises:
        MissingDependencyError: Numba is not installed.
    """
    result: _Function = _numba().njit(inline="always", **_OPTIONS)(function)
    return result


def compiled_if_installed(function: _Function) -> _Function:
    """Have Numba compile a function as ``compiled`` does; without Numba Python runs the same loop, slowly."""
    return compiled(function) if _is_installed() else function


def reordered(function: _Function) -> _Function:
    """Have Numba compile a function as ``compiled`` does, and let it change the order in which numbers are added up.

    It may then take several at once, which a check for division by zero would forbid.
    """
    result: _Function = _numba().njit(fastmath={"reassoc", "contract"}, **_OPTIONS)(function)
    return result


@cache
def _numba() -> Any:
    """Return Numba, which from now on says when it compiles, and has no garbage collected meanwhile.

    What it makes for one function lives until that is compiled: to go through it time and again took a tenth of all.
    """
    try:
        import numba
    except ImportError as error:
        raise MissingDependencyError("Numba is not installed; expected it from: pip install numba") from error
    from numba.core import event

    class Listener(event.Listener):
        n_begun = 0
        collects = False

        def on_start(self, event: Any) -> None:
            global _tell
            tell, _tell = _tell, None
            if tell is not None:
                tell()
            if self.n_begun == 0:
                self.collects = gc.isenabled()
                gc.disable()
            self.n_begun += 1

        def on_end(self, event: Any) -> None:
            self.n_begun -= 1
            if self.n_begun == 0 and self.collects:
                gc.enable()

    event.register("numba:compile", Listener())  # type: ignore[no-untyped-call]
    return numba
