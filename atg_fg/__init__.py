"""Aspect Transition Graphs as discrete factor graphs: recognise objects by acting on them.

A public name is imported when it is first used: the imports below are read by type checkers, and by ``__getattr__``.
"""

import ast
from importlib import import_module
from typing import TYPE_CHECKING, Any

# They register their environments with gymnasium.
from atg_fg import experiments as experiments
from atg_fg import worlds as worlds
from atg_fg.core.version import __version__ as __version__

if TYPE_CHECKING:
    from atg_fg.core.aspect_graph import AspectTransitionGraph
    from atg_fg.core.assumptions import Assumptions, arcube_assumptions
    from atg_fg.core.belief import IdentityBelief
    from atg_fg.core.errors import AtgError
    from atg_fg.core.goals import Goal
    from atg_fg.core.memory import RobotMemory
    from atg_fg.core.object_sense import ObjectSense
    from atg_fg.core.parameters import ModelParameters
    from atg_fg.core.patterns import Evidence, PatternAlphabet
    from atg_fg.core.records import TrialRecord
    from atg_fg.display.comparison_plot import plot_comparison
    from atg_fg.display.success_plots import plot_ablation, plot_success
    from atg_fg.display.trial_plots import plot_atg, plot_belief, plot_entropy
    from atg_fg.engines import ENGINES, begin_trial
    from atg_fg.experiments.engine_comparison import compare_engines
    from atg_fg.experiments.recognition_agent import RecognitionAgent
    from atg_fg.experiments.recognition_env import RecognitionEnv
    from atg_fg.experiments.result_tables import results_table
    from atg_fg.experiments.scores import TestResult
    from atg_fg.experiments.table1 import TestPlan, run_test, run_tests
    from atg_fg.experiments.trial import learn_from, run_trial
    from atg_fg.inference.factor_graph import RecognitionGraph
    from atg_fg.inference.interface import Inference
    from atg_fg.inference.joint_factor_graph import JointRecognitionGraph
    from atg_fg.learning.structured_memory import StructuredMemory
    from atg_fg.policies import POLICIES, AgentPolicy, GoalPolicy, StoppingPolicy, make_policy
    from atg_fg.storage.memory_files import load_memory, open_memory, save_memory
    from atg_fg.storage.presets import PRESETS, preset
    from atg_fg.worlds.arcube import make_arcubes
    from atg_fg.worlds.registry import WORLDS, assumptions_of, make_world
else:

    def __getattr__(name: str) -> Any:
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        for node in ast.walk(ast.parse(__loader__.get_source(__name__))):
            if isinstance(node, ast.ImportFrom) and name in [each.name for each in node.names]:
                globals()[name] = getattr(import_module(node.module), name)
        return globals()[name]

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})


__all__ = [
    "ENGINES",
    "POLICIES",
    "PRESETS",
    "WORLDS",
    "AgentPolicy",
    "AspectTransitionGraph",
    "Assumptions",
    "AtgError",
    "Evidence",
    "Goal",
    "GoalPolicy",
    "IdentityBelief",
    "Inference",
    "JointRecognitionGraph",
    "ModelParameters",
    "ObjectSense",
    "PatternAlphabet",
    "RecognitionAgent",
    "RecognitionEnv",
    "RecognitionGraph",
    "RobotMemory",
    "StoppingPolicy",
    "StructuredMemory",
    "TestPlan",
    "TestResult",
    "TrialRecord",
    "arcube_assumptions",
    "assumptions_of",
    "begin_trial",
    "compare_engines",
    "learn_from",
    "load_memory",
    "make_arcubes",
    "make_policy",
    "make_world",
    "open_memory",
    "plot_ablation",
    "plot_atg",
    "plot_belief",
    "plot_comparison",
    "plot_entropy",
    "plot_success",
    "preset",
    "results_table",
    "run_test",
    "run_tests",
    "run_trial",
    "save_memory",
]
