"""Does an agent that learns by reinforcement choose as well as expected entropy? Success on the same seeds.

Run with ``python benchmarks/agents.py [TESTS] [STEPS]``; needs Stable-Baselines3: ``pip install ".[agents]"``. Ideal
world, preset ``default``, 6 actions a trial. PPO is trained for STEPS actions on 100 cubes of its own (seed 1000),
rewarded by the entropy that each action takes away, once with and once without the expected gains among what it sees.
Then what it thinks best is done in tests of 100 trials, as what the other policies choose. 95 % Wilson intervals over
all trials; differences to ``entropy`` with the standard error of a paired mean over tests.
"""

from __future__ import annotations

import statistics
import sys
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.statistics import standard_error
from atg_fg.experiments.recognition_env import make_recognition_env
from atg_fg.experiments.scores import TestResult, pooled_interval
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.policies import AgentPolicy, Policy, make_policy
from atg_fg.policies.belief_features import TOP, BeliefFeatures
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import ACTION_SOURCES

N_ACTIONS = 6
OBJECTS_SEED = 1000


class FirstOfTheBest:
    """The rule of the policy ``entropy`` but for ties, of which it takes the first action, as a network does."""

    def predict(self, observation: NDArray[np.float32], deterministic: bool = True) -> tuple[int, None]:
        """Return the action of the greatest expected gain."""
        return int(observation[TOP + 3 :][: len(ACTION_SOURCES)].argmax()), None


def trained(n_steps: int, *, expected_entropies: bool, seed: int = 0) -> AgentPolicy:
    """Return PPO after ``n_steps`` actions, as a policy."""
    from stable_baselines3 import PPO

    summary = BeliefFeatures(arcube_assumptions(), expected_entropies=expected_entropies)
    env = make_recognition_env(objects_seed=OBJECTS_SEED, n_actions=N_ACTIONS, reward="entropy", summary=summary)
    settings: dict[str, Any] = {"n_steps": 600, "batch_size": 100, "gamma": 0.0, "learning_rate": 1e-3}
    agent = PPO("MlpPolicy", env, seed=seed, device="cpu", **settings)
    agent.learn(n_steps)
    return AgentPolicy(agent, summary)


def row(name: str, tests: list[TestResult], usual: list[TestResult]) -> list[str]:
    rates, theirs = ([100 * test.success[0] / test.success[1] for test in column] for column in (tests, usual))
    differences = [one - other for one, other in zip(rates, theirs, strict=True)]
    low, high = pooled_interval(tests, "success")
    error = standard_error(differences)
    spread = "" if error is None else f" ± {error:.1f}"
    success = f"{statistics.fmean(rates):.1f} % ({100 * low:.1f}-{100 * high:.1f})"
    return [name, success, f"{statistics.fmean(differences):+.1f}{spread}"]


def main() -> None:
    """Train, test and print the table."""
    n_tests = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    n_steps = int(sys.argv[2]) if len(sys.argv) > 2 else 12_000
    console = Console(highlight=False, width=120)
    policies: dict[str, Policy] = {name: make_policy(name) for name in ("entropy", "random")}
    policies["entropy, first of ties"] = AgentPolicy(FirstOfTheBest())
    for name, sees in (("PPO, sees expected gains", True), ("PPO, does not", False)):
        start = time.process_time()
        policies[name] = trained(n_steps, expected_entropies=sees)
        console.print(f"{name}: trained for {n_steps} actions, {time.process_time() - start:.0f} s of processor time")
    plan = TestPlan(engine="bayes-filter", parameters=preset("default"), n_actions=N_ACTIONS)
    tests = {name: [run_test(plan, seed, policy=each) for seed in range(n_tests)] for name, each in policies.items()}
    table = Table(
        title=f"{n_tests} tests of 100 trials, {N_ACTIONS} actions, seeds 0 to {n_tests - 1}", title_justify="left"
    )
    for heading in ("policy", "success", "difference to entropy"):
        table.add_column(heading, justify="left" if heading == "policy" else "right")
    for name, results in tests.items():
        table.add_row(*row(name, results, tests["entropy"]))
    console.print(table)


if __name__ == "__main__":
    main()
