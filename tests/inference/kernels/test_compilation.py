"""Loops are compiled once, someone is told, and without Numba NumPy does."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core import event

from atg_fg.inference.kernels import belief_kernels  # noqa: F401  (it has Numba listened to)

TRIAL = """
import sys
from atg_fg.inference.kernels import compilation
from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
compilation.tell_of_compilation(lambda: print("compiling"))
assumptions = arcube_assumptions(5)
inference = begin_trial("bayes-filter", RobotMemory(assumptions), ModelParameters(learn_in_trial=True))
inference.observe(Evidence.of_detection(assumptions.alphabet, (0, 1)))
inference.expected_entropies()
print("numba" in sys.modules)
"""


def printed(code: str, **environment: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[2],
    )
    return done.stdout.split()


@pytest.mark.slow
def test_the_first_process_tells_once_that_it_compiles_and_the_second_compiles_nothing(tmp_path: Path) -> None:
    assert printed(TRIAL, NUMBA_CACHE_DIR=str(tmp_path)) == ["compiling", "True"]
    assert printed(TRIAL, NUMBA_CACHE_DIR=str(tmp_path)) == ["True"]


def test_without_numba_the_engine_is_the_one_in_numpy() -> None:
    hidden = "import sys; sys.modules['numba'] = None; import importlib.util as u; f = u.find_spec;"
    hidden += "u.find_spec = lambda name, *more: None if name == 'numba' else f(name, *more)\n"
    assert printed(hidden + TRIAL.replace('"numba" in sys.modules', "type(inference.model).__name__")) == [
        "RecognitionModel"
    ]


def test_the_switch_leaves_compiled_loops_out() -> None:
    assert printed(TRIAL, ATG_FG_KERNELS="0") == ["False"]


def test_nothing_loads_numba_before_it_is_used() -> None:
    code = "import sys, atg_fg, atg_fg.cli, atg_fg.engines.bayes_filter; print('numba' in sys.modules)"
    assert printed(code) == ["False"]


def test_no_garbage_is_collected_until_all_that_one_loop_calls_is_compiled() -> None:
    with event.trigger_event("numba:compile"):
        with event.trigger_event("numba:compile"):
            assert not gc.isenabled()
        assert not gc.isenabled()
    assert gc.isenabled()


def test_a_process_that_collects_no_garbage_does_not_begin_to_with_compilation() -> None:
    gc.disable()
    try:
        with event.trigger_event("numba:compile"):
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()
