"""The tests of the engines catch errors: each is planted in a copy of the library, and the copy's tests must fail."""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: The first two chunks of random models, every engine, the oracle beside them.
TESTS = ["tests/engines/test_agreement.py", "-k", "posterior and (-0] or -1])"]
#: Of faults in these folders: the compiled filter beside the one in NumPy; kinds of objects beside sums over all cases.
TESTS_OF = {
    "inference/kernels/": ["tests/inference/kernels/test_compiled_filter.py"],
    "learning/pose_chain": ["tests/learning/test_pose_chain.py", "-k", "sum_over_poses"],
    "learning/pose_": ["tests/learning/test_likelihood.py", "-k", "known_are_filtered or clean_trial or after_slips"],
    "learning/prediction": ["tests/learning/test_pose_filter.py", "-k", "predicted"],
    "learning/learner": ["tests/learning/test_learner.py", "-k", "remembered_object"],
    "learning/": [f"tests/learning/test_{name}.py" for name in ("state_merging", "kinds", "plain_evidence")],
}


@dataclass(frozen=True)
class Fault:
    """One error: in a file, a text that stands there once, and what stands there instead."""

    name: str
    file: str
    right: str
    wrong: str


FAULTS = [
    Fault(
        "transitions transposed",
        "inference/recognition_model.py",
        "where = (self.edges.hypothesis[chosen], self.edges.source[chosen], self.edges.target[chosen])",
        "where = (self.edges.hypothesis[chosen], self.edges.target[chosen], self.edges.source[chosen])",
    ),
    Fault(
        "posterior not normalised",
        "engines/bayes_filter.py",
        "self._state = FilterState(log_joint - log_probability, aspects)",
        "self._state = FilterState(log_joint, aspects)",
    ),
    Fault(
        "keys of the transition factor in the wrong order",
        "inference/factor_graph.py",
        "self._add([self.object_key, self.aspect_key(time - 1), self.aspect_key(time)], transition)",
        "self._add([self.object_key, self.aspect_key(time), self.aspect_key(time - 1)], transition)",
    ),
    Fault(
        "mass of the collection node lost",
        "inference/recognition_model.py",
        "self.base_row[:, COLLECTION] = n_unobserved / self.n_aspects",
        "self.base_row[:, COLLECTION] = 0.0",
    ),
    Fault(
        "one unseen object too many",
        "core/memory.py",
        "return max(self.assumptions.n_objects - len(self), 1)",
        "return max(self.assumptions.n_objects - len(self) + 1, 1)",
    ),
    Fault(
        "unseen objects counted as one in the entropy",
        "core/belief.py",
        "float(self.unseen * np.log(self.n_unseen) - x_log_x(self.probabilities).sum())",
        "float(-x_log_x(self.probabilities).sum())",
    ),
    Fault(
        "noise of observations left out where a pattern is known",
        "inference/recognition_model.py",
        "shown = (1.0 - self.parameters.observation_noise) * evidence.likelihood + noise",
        "shown = (1.0 - self.parameters.observation_noise) * evidence.likelihood",
    ),
    Fault(
        "patterns of known aspects expected of the collection node",
        "inference/recognition_model.py",
        "(1.0 - delta) / np.maximum(self.n_lacking, 1.0)",
        "(1.0 - delta) / self.n_patterns",
    ),
    Fault(
        "concentration left out of the edges' share",
        "inference/recognition_model.py",
        "self.edge_probability = edges.weight / totals",
        "self.edge_probability = edges.weight / (totals - alpha)",
    ),
    Fault(
        "all of the collection node's belief given to a new aspect",
        "inference/recognition_model.py",
        "shares = np.where(last, 1.0, truth / (truth + noise))",
        "shares = np.ones_like(truth)",
    ),
    Fault(
        "smoothing forward only",
        "inference/chain.py",
        "return [_normalised(past * future) for past, future in zip(forward, reversed(backward), strict=True)]",
        "return forward",
    ),
    Fault(
        "every edge counted once, however often it was seen",
        "inference/recognition_model.py",
        "self.edges = Edges(action, owners, 1 + source, 1 + target, count.astype(np.float64))",
        "self.edges = Edges(action, owners, 1 + source, 1 + target, np.ones(len(count)))",
    ),
    Fault(
        "evidence of the look before used for the look",
        "inference/chain.py",
        "likelihood = model.pattern_likelihood(evidence)",
        "likelihood = model.pattern_likelihood(history.evidence[max(step - 1, 0)])",
    ),
    Fault(
        "expected entropy without its unseen objects",
        "inference/expected_entropy.py",
        " - joint_terms + unseen * np.log(model.n_unseen)",
        " - joint_terms",
    ),
    Fault(
        "compiled: an aspect found takes all of the collection node",
        "inference/kernels/belief_kernels.py",
        "revealed = aspects[hypothesis, 0] * (1.0 if target == n_aspects else truth / (truth + noise))",
        "revealed = aspects[hypothesis, 0]",
    ),
    Fault(
        "compiled: a state shows its pattern without noise",
        "inference/kernels/belief_kernels.py",
        "aspects[hypothesis, state] *= (observed * evidence[pattern[hypothesis, state]] + noise) * scale",
        "aspects[hypothesis, state] *= (observed * evidence[pattern[hypothesis, state]]) * scale",
    ),
    Fault(
        "compiled: a new edge out of its order",
        "inference/kernels/table_kernels.py",
        "while place > first and (",
        "while False and (",
    ),
    Fault(
        "merging: states of different slots are one",
        "learning/merging_kernels.py",
        "if automaton.mode[one] != automaton.mode[two] or automaton.place[one] != automaton.place[two]:",
        "if n_left < 0:",
    ),
    Fault(
        "merging: states of different modes are one",
        "learning/merging_kernels.py",
        "if automaton.mode[one] != automaton.mode[two] or automaton.place[one] != automaton.place[two]:",
        "if automaton.place[one] != automaton.place[two]:",
    ),
    Fault(
        "merging: two symbols of one look are in one place",
        "learning/merging_kernels.py",
        "if automaton.looks[one, word] & automaton.looks[two, word]:",
        "if word < 0:",
    ),
    Fault(
        "merging: nothing folds backward",
        "learning/merging_kernels.py",
        "if not link(automaton, state, back, previous, to_do):",
        "if back < 0:",
    ),
    Fault(
        "merging: a state in view is not that of its slot",
        "learning/merging_kernels.py",
        "if place < n_slots and not unite(",
        "if place < n_slots - 1 and not unite(",
    ),
    Fault(
        "kinds: all are as probable beforehand",
        "learning/kinds.py",
        "return np.array([*PLAIN_BEFORE, *[1.0] * (n_kinds - N_PLAIN)])",
        "return np.ones(n_kinds)",
    ),
    Fault(
        "kinds: a trial with too many errors is one of the kind",
        "learning/kinds.py",
        "np.minimum(evidence, plain.max(axis=1) - REFUSED)",
        "evidence",
    ),
    Fault(
        "kinds: the doubt about which kind a trial is of does not count",
        "learning/kind_kernels.py",
        "bound += share * (table[row, kind] - np.log(share))",
        "bound += share * table[row, kind] + 1.0",
    ),
    Fault(
        "plain evidence: no transition is counted within the trial",
        "learning/kind_kernels.py",
        "counted_from = patterns[time - 1] if time > 0 else -1",
        "counted_from = -1",
    ),
    Fault(
        "plain evidence: objects never met count as one",
        "learning/plain_evidence.py",
        "math.log(n_objects - len(self._graphs))",
        "0.0",
    ),
    Fault(
        "plain evidence: the object that a trial is filed under is not there",
        "learning/plain_evidence.py",
        "filed = of_each[:, rivals.index(owner)] if owner in rivals else fresh",
        "filed = fresh",
    ),
    Fault(
        "kinds: trials of an object met again are as those of any",
        "learning/learner.py",
        "self._plain.of_kinds(self.noise, FILED)",
        "self._plain.of_kinds(self.noise)",
    ),
    Fault(
        "kinds: an object is of the kind of its last trial",
        "learning/learner.py",
        "np.add.at(by_object, self._owner_indices, by_trial)",
        "by_object[self._owner_indices] = by_trial",
    ),
    Fault(
        "poses: an action that fails has led on as well",
        "learning/pose_kernels.py",
        "weight[row] *= 1.0 - slip",
        "weight[row] *= 1.0",
    ),
    Fault(
        "poses: an action that turned the object still counts as failed",
        "learning/pose_kernels.py",
        "events[row, FAILED + action] = 0.0",
        "events[row, FAILED + action] = failed_before",
    ),
    Fault(
        "poses: which action failed is not remembered",
        "learning/pose_kernels.py",
        "events[stayed, FAILED + action] = 1.0",
        "events[stayed, FAILED + action] = failed_before",
    ),
    Fault(
        "poses: what is predicted leaves out which action failed",
        "learning/prediction_kernels.py",
        "slip = (1.0 - failed_before) * slips[0] + failed_before * slips[1]",
        "slip = slips[0]",
    ),
    Fault(
        "pose chain: any action that failed makes the others fail",
        "learning/pose_chain.py",
        "slip = rates.slips[bool(failed & own)]",
        "slip = rates.slips[bool(failed)]",
    ),
    Fault(
        "kinds: an action that fails over and over counts each time",
        "learning/kinds.py",
        "wrong + events[..., SLIP] - events[..., AGAIN] > most_events",
        "wrong + events[..., SLIP] > most_events",
    ),
    Fault(
        "rates: whether slips come together is told by the kinds in force",
        "learning/kinds.py",
        "return Tally(*map(sum, zip(*tallies, strict=True))), commonest.tally(alone)",
        "return (Tally(*map(sum, zip(*tallies, strict=True))),) * 2",
    ),
    Fault(
        "poses: a look reveals nothing",
        "learning/pose_kernels.py",
        "table[register, symbol] += truth[row]",
        "table[register, symbol] += 0.0",
    ),
]


def passes_its_tests(folder: Path, tests: list[str] = TESTS) -> bool:
    """Run the copy's own tests in the folder of the copy: of the engines, all in NumPy, or others."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-n", "0", *tests]
    environment = {**os.environ, "PYTHONPATH": str(folder), "ATG_FG_KERNELS": "0"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1), done.stdout + done.stderr
    return done.returncode == 0


@pytest.fixture
def copy(tmp_path):
    for name in ("atg_fg", "tests"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


@pytest.mark.slow
def test_the_copy_without_a_fault_passes(copy):
    assert passes_its_tests(copy)


@pytest.mark.parametrize(
    "fault",
    [FAULTS[0], *(pytest.param(fault, marks=pytest.mark.slow) for fault in FAULTS[1:])],
    ids=lambda fault: fault.name,
)
def test_a_planted_fault_is_caught(fault, copy):
    file = copy / "atg_fg" / fault.file
    text = file.read_text()
    assert text.count(fault.right) == 1, f"{fault.file} has changed; expected once: {fault.right}"
    file.write_text(text.replace(fault.right, fault.wrong))
    tests = next((tests for folder, tests in TESTS_OF.items() if fault.file.startswith(folder)), TESTS)
    assert not passes_its_tests(copy, tests), f"not caught: {fault.name}"
