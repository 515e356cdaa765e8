"""Aspect Transition Graphs as discrete factor graphs: recognise objects by acting on them."""

from atg_fg.all_different import different_identities, identity_given_others
from atg_fg.arcube import make_arcubes
from atg_fg.assumptions import Assumptions, arcube_assumptions
from atg_fg.belief import IdentityBelief
from atg_fg.belief_summary import BeliefSummary
from atg_fg.belief_table import BeliefTable
from atg_fg.engines import ENGINES, begin_trial
from atg_fg.engines.base import Inference
from atg_fg.errors import AtgError
from atg_fg.experiments import TestPlan, TestResult, learn_from, run_test, run_tests, summarise
from atg_fg.goals import Goal
from atg_fg.graph import AspectTransitionGraph
from atg_fg.joint_recognition import JointRecognitionGraph
from atg_fg.memory import RobotMemory
from atg_fg.object_families import FAMILIES
from atg_fg.object_worlds import ObjectWorld
from atg_fg.objects import FiniteObject, Mechanism, ObjectFamily
from atg_fg.parameters import ModelParameters
from atg_fg.patterns import Evidence, PatternAlphabet
from atg_fg.plots import plot_ablation, plot_atg, plot_belief, plot_entropy, plot_success
from atg_fg.policies import POLICIES, AgentPolicy, GoalPolicy, LookaheadPolicy, StoppingPolicy, make_policy
from atg_fg.presets import PRESETS, preset
from atg_fg.recognition import RecognitionGraph
from atg_fg.recognition_agent import RecognitionAgent
from atg_fg.recognition_env import RecognitionEnv
from atg_fg.result_tables import results_table
from atg_fg.store import load_memory, save_memory
from atg_fg.structure.memory import StructuredMemory
from atg_fg.structure.shared_structure import SharedStructure
from atg_fg.trial import TrialRecord, run_trial
from atg_fg.worlds import WORLDS, assumptions_of, make_world

__version__ = "0.1.0"

__all__ = [
    "ENGINES",
    "FAMILIES",
    "POLICIES",
    "PRESETS",
    "WORLDS",
    "AgentPolicy",
    "AspectTransitionGraph",
    "Assumptions",
    "AtgError",
    "BeliefSummary",
    "BeliefTable",
    "Evidence",
    "FiniteObject",
    "Goal",
    "GoalPolicy",
    "IdentityBelief",
    "Inference",
    "JointRecognitionGraph",
    "LookaheadPolicy",
    "Mechanism",
    "ModelParameters",
    "ObjectFamily",
    "ObjectWorld",
    "PatternAlphabet",
    "RecognitionAgent",
    "RecognitionEnv",
    "RecognitionGraph",
    "RobotMemory",
    "SharedStructure",
    "StoppingPolicy",
    "StructuredMemory",
    "TestPlan",
    "TestResult",
    "TrialRecord",
    "arcube_assumptions",
    "assumptions_of",
    "begin_trial",
    "different_identities",
    "identity_given_others",
    "learn_from",
    "load_memory",
    "make_arcubes",
    "make_policy",
    "make_world",
    "plot_ablation",
    "plot_atg",
    "plot_belief",
    "plot_entropy",
    "plot_success",
    "preset",
    "results_table",
    "run_test",
    "run_tests",
    "run_trial",
    "save_memory",
    "summarise",
]
