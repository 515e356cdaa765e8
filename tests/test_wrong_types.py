"""What is no value of the right kind is refused by name, wherever a user can hand it in."""

from importlib.util import find_spec

import numpy as np
import pytest

import atg_fg
from atg_fg import (
    Assumptions,
    Evidence,
    ModelParameters,
    PatternAlphabet,
    RobotMemory,
    TrialRecord,
    arcube_assumptions,
    begin_trial,
)
from atg_fg.core.checks import brief
from atg_fg.core.errors import AtgError

WRONG = (
    None,
    True,
    -1,
    1.5,
    float("nan"),
    10**5000,
    b"x",
    [None],
    {1: 2},
    {3},
    object(),
    np.array([[1.5]]),
    np.array([1.0, float("nan")]),
    {"a": None},
    "\ud800",
)
PAPER = arcube_assumptions(10)
NAMED = PatternAlphabet.named(("front",), ("a", "b"), is_open=True)


def remembered():
    memory = RobotMemory(PAPER)
    memory.learn([0, 1], [0], None, "cup")
    return memory


def observed(look):
    engine = begin_trial("bayes-filter", remembered(), ModelParameters())
    engine.observe(look)
    return engine


IDEAL = atg_fg.make_world("ideal")
RNG = np.random.default_rng(0)
TINY = atg_fg.TestPlan(engine="bayes-filter", n_trials=1, n_actions=1)
GOAL = atg_fg.Goal(PAPER.alphabet, (0, None))
RECORD = TrialRecord.from_looks(PAPER, [(0, 1), (2, 1)], ["left"])

CALLS = {
    "slots": lambda wrong: PatternAlphabet.named(wrong, ("a", "b")),
    "names": lambda wrong: PatternAlphabet.named(("front",), wrong),
    "n_symbols": lambda wrong: PatternAlphabet(("front", "top"), wrong),
    "more names": lambda wrong: NAMED.extended(wrong),
    "pattern": lambda wrong: PAPER.alphabet.index(wrong),
    "n_objects": arcube_assumptions,
    "actions": lambda wrong: Assumptions(3, 2, wrong, PAPER.alphabet),
    "alphabet": lambda wrong: Assumptions(3, 2, ("go",), wrong),
    "likelihood": lambda wrong: Evidence.of_likelihood(PAPER.alphabet, wrong),
    "likelihoods": lambda wrong: Evidence.of_slots(PAPER.alphabet, wrong),
    "assumptions": RobotMemory,
    "patterns": lambda wrong: RobotMemory(PAPER).learn(wrong, [0], None),
    "actions learned": lambda wrong: RobotMemory(PAPER).learn([0, 1], wrong, None),
    "matched": lambda wrong: remembered().learn([0, 1], [0], wrong if wrong is not None else 3),
    "old name": lambda wrong: remembered().rename(wrong, "mug"),
    "new name": lambda wrong: remembered().rename("cup", wrong),
    "memory": lambda wrong: begin_trial("bayes-filter", wrong, ModelParameters()),
    "parameters": lambda wrong: begin_trial("bayes-filter", remembered(), wrong),
    "engine": lambda wrong: begin_trial(wrong, remembered(), ModelParameters()),
    "policy": atg_fg.make_policy,
    "world": atg_fg.make_world,
    "preset": atg_fg.preset,
    "number of cubes": lambda wrong: atg_fg.make_arcubes(wrong, seed=0),
    "looks": lambda wrong: TrialRecord.from_looks(PAPER, wrong, []),
    "one look": lambda wrong: TrialRecord.from_looks(PAPER, [wrong if wrong is not None else 3], []),
    "actions done": lambda wrong: TrialRecord.from_looks(PAPER, [None, None], wrong),
    "confidences": lambda wrong: Evidence.of_detection(PAPER.alphabet, (0, 1), wrong if wrong is not None else 3),
    "confidence": lambda wrong: Evidence.of_detection(PAPER.alphabet, (0, 1), (wrong if wrong is not None else "x", 1)),
    "look": lambda wrong: observed(wrong if wrong is not None else 3),
    "look of a slot": lambda wrong: observed({"front": wrong if wrong is not None else 1.5}),
    "plan": lambda wrong: atg_fg.run_test(wrong, 0),
    "seed": lambda wrong: atg_fg.run_test(TINY, wrong),
    "records": lambda wrong: atg_fg.run_test(TINY, 0, wrong if wrong is not None else 3),
    "memories": lambda wrong: atg_fg.run_test(TINY, 0, memories=wrong if wrong is not None else 3),
    "policy of a test": lambda wrong: atg_fg.run_test(TINY, 0, policy=wrong if wrong is not None else 3),
    "plans": atg_fg.run_tests,
    "one plan": lambda wrong: atg_fg.run_tests([wrong]),
    "parameters of a plan": lambda wrong: atg_fg.TestPlan(parameters=wrong),
    "options of a world": lambda wrong: atg_fg.TestPlan(world_options=wrong),
    "threshold": lambda wrong: atg_fg.StoppingPolicy(atg_fg.make_policy("entropy"), wrong),
    "policy that stops": lambda wrong: atg_fg.StoppingPolicy(wrong, 0.1),
    "inference": lambda wrong: atg_fg.run_trial(IDEAL, wrong, atg_fg.make_policy("entropy"), 1, RNG),
    "generator": lambda wrong: atg_fg.run_trial(IDEAL, observed(None), atg_fg.make_policy("entropy"), 1, wrong),
    "world of a trial": lambda wrong: atg_fg.run_trial(wrong, observed(None), atg_fg.make_policy("entropy"), 1, RNG),
    "record": lambda wrong: atg_fg.learn_from(wrong, remembered()),
    "memory that learns": lambda wrong: atg_fg.learn_from(RECORD, wrong),
    "memory of an agent": lambda wrong: atg_fg.RecognitionAgent(wrong, ModelParameters()),
    "parameters of an agent": lambda wrong: atg_fg.RecognitionAgent(remembered(), wrong),
    "policy of an agent": lambda wrong: atg_fg.RecognitionAgent(remembered(), ModelParameters(), policy=wrong),
    "seed of an agent": lambda wrong: atg_fg.RecognitionAgent(remembered(), ModelParameters(), seed=wrong),
    "engine of an agent": lambda wrong: atg_fg.RecognitionAgent(
        remembered(), ModelParameters(), engine=wrong if wrong is not None else 3
    ),
    "world of an environment": lambda wrong: atg_fg.RecognitionEnv(wrong, remembered(), ModelParameters()),
    "memory of an environment": lambda wrong: atg_fg.RecognitionEnv(IDEAL, wrong, ModelParameters()),
    "engines compared": lambda wrong: atg_fg.compare_engines(wrong, remembered(), [RECORD]),
    "memory compared": lambda wrong: atg_fg.compare_engines(["bayes-filter"], wrong, [RECORD]),
    "trials compared": lambda wrong: atg_fg.compare_engines(["bayes-filter"], remembered(), wrong),
    "one trial compared": lambda wrong: atg_fg.compare_engines(["bayes-filter"], remembered(), [wrong]),
    "goal": lambda wrong: atg_fg.Goal(PAPER.alphabet, wrong),
    "alphabet of a goal": lambda wrong: atg_fg.Goal(wrong, (0, None)),
    "goal of a policy": atg_fg.GoalPolicy,
    "planner": lambda wrong: atg_fg.GoalPolicy(GOAL, wrong),
    "what is unreachable": lambda wrong: atg_fg.GoalPolicy(GOAL, unreachable=wrong),
    "threshold of a goal": lambda wrong: atg_fg.GoalPolicy(GOAL, entropy_threshold=wrong),
    "confidence of a goal": lambda wrong: atg_fg.GoalPolicy(GOAL, confidence=wrong),
    "wanted": lambda wrong: atg_fg.Goal.of_slots(PAPER.alphabet, wrong),
    "text of a goal": lambda wrong: atg_fg.Goal.parse(PAPER.alphabet, wrong),
    "prior": lambda wrong: begin_trial(
        "bayes-filter", remembered(), ModelParameters(), wrong if wrong is not None else 3
    ),
    "graph's name": lambda wrong: atg_fg.AspectTransitionGraph(wrong, PAPER),
    "graph's assumptions": lambda wrong: atg_fg.AspectTransitionGraph("cup", wrong),
    "assumptions of a structured memory": atg_fg.StructuredMemory,
    "agent": atg_fg.AgentPolicy,
    "trial of a graph": lambda wrong: atg_fg.RecognitionGraph(wrong, 1),
    "memory to load": atg_fg.load_memory,
    "memory to open": atg_fg.open_memory,
    "place to save to": lambda wrong: atg_fg.save_memory(remembered(), wrong),
    "action": lambda wrong: observed((0, 1)).act(wrong),
}

POINT = {"actions": 3, "policy": "entropy", "success": 0.5, "interval95": (0.4, 0.6)}
ENTRY = {**POINT, "world": "ideal", "noise": "none", "variant": "default"}
BELIEFS = [observed((0, 1)).identity()]

PLOTS = {
    "graph or trial": atg_fg.plot_atg,
    "images": lambda wrong: atg_fg.plot_atg(remembered()["cup"], symbol_images=wrong if wrong is not None else 3),
    "image": lambda wrong: atg_fg.plot_atg(remembered()["cup"], symbol_images={0: wrong}),
    "highlight": lambda wrong: atg_fg.plot_atg(remembered()["cup"], highlight=wrong if wrong is not None else 9),
    "path": lambda wrong: atg_fg.plot_atg(remembered()["cup"], path=wrong),
    "beliefs": lambda wrong: atg_fg.plot_belief(wrong, ["cup"]),
    "names of objects": lambda wrong: atg_fg.plot_belief(BELIEFS, wrong),
    "top": lambda wrong: atg_fg.plot_belief(BELIEFS, ["cup"], top=wrong),
    "entropies": atg_fg.plot_entropy,
    "expected": lambda wrong: atg_fg.plot_entropy([1.0, 0.5], wrong, ["push"]),
    "expected of a look": lambda wrong: atg_fg.plot_entropy([1.0, 0.5], [wrong], ["push"]),
    "chosen": lambda wrong: atg_fg.plot_entropy([1.0, 0.5], [{"push": 1.0}], wrong),
    "results": atg_fg.plot_success,
    "one result": lambda wrong: atg_fg.plot_success([wrong]),
    "compared results": lambda wrong: atg_fg.plot_success({"ours": wrong}),
    "title": lambda wrong: atg_fg.plot_success([POINT], title=wrong if wrong is not None else 3),
    "entries": atg_fg.plot_ablation,
    "one entry": lambda wrong: atg_fg.plot_ablation([wrong]),
    "engines": atg_fg.plot_comparison,
    "one engine": lambda wrong: atg_fg.plot_comparison({"ours": wrong}),
    **{f"{key} of a point": lambda wrong, key=key: atg_fg.plot_success([{**POINT, key: wrong}]) for key in POINT},
    **{
        f"{key} of an entry": lambda wrong, key=key: atg_fg.plot_ablation([{**ENTRY, key: wrong}])
        for key in ENTRY
        if key != "policy"
    },
}
TABLES = {
    "results of a table": atg_fg.results_table,
    "results in a table": lambda wrong: atg_fg.results_table({"ours": wrong}),
    "title of a table": lambda wrong: atg_fg.results_table([POINT], wrong if wrong is not None else 3),
    **{f"{key} in a table": lambda wrong, key=key: atg_fg.results_table([{**POINT, key: wrong}]) for key in POINT},
}
CALLS |= TABLES | (PLOTS if find_spec("matplotlib") else {})

LARGE = brief(10**5000)
#: They have a method ``choose``, as policies do.
ARRAYS = [brief(each) for each in WRONG if isinstance(each, np.ndarray)]

#: What is a value there, after all.
RIGHT = {
    "seed": [LARGE],
    "seed of an agent": [LARGE],
    "top": [LARGE],
    "policy of a test": ARRAYS,
    "policy that stops": ARRAYS,
    "policy of an agent": ARRAYS,
    "options of a world": [brief({"a": None})],
    "threshold": ["1.5"],
    "threshold of a goal": ["1.5"],
    "confidence": ["-1", "1.5"],
    "image": ["array([[1.5]])"],
    "images": ["{}"],
    "actions of a point": ["1.5"],
    "actions of an entry": ["1.5"],
    "actions in a table": ["1.5"],
    "actions learned": ["[None]"],
    "looks": ["[None]"],
    "look of a slot": ["{1: 2}"],
    "action": ["None"],
}


@pytest.mark.parametrize("what", CALLS)
def test_a_wrong_type_is_an_error_of_this_project_in_one_line(what):
    for wrong in (each for each in WRONG if brief(each) not in RIGHT.get(what, ())):
        with pytest.raises(AtgError) as refused:
            CALLS[what](wrong)
        message = str(refused.value)
        assert "expected" in message, message
        assert len(message) < 600


def test_a_plan_of_more_than_memory_holds_is_refused_before_anything_is_drawn():
    for name in ("n_actions", "n_trials", "n_objects"):
        with pytest.raises(AtgError, match=f"{name}: 100001; expected a whole number from 1 to 100000"):
            atg_fg.TestPlan(**{name: 100_001})


def test_a_trial_is_made_of_looks_as_an_engine_takes_them():
    assumptions = Assumptions(3, 2, ("go",), NAMED)
    looks = [("a",), {"front": "b"}, {"front": {"a": 0.8, "b": 0.2}}, None, Evidence.of_detection(NAMED, (0,))]
    record = TrialRecord.from_looks(assumptions, looks, ["go"] * 4)
    assert [*record.detections] == [(0,), (1,), (None,), (None,), (0,)]
    memory = RobotMemory(assumptions)
    atg_fg.learn_from(record, memory)
    assert memory.names == ("object-000",)
