"""Simulation-based calibration: evidence drawn from the model itself, and posteriors held against what was drawn.

If inference is exact, the posterior averaged over the data is the prior, and of all times that an object was given
probability p, it was the one in a share p.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.engines import begin_trial
from atg_fg.experiments.engine_comparison import ComparisonPlan
from atg_fg.inference.recognition_model import COLLECTION, RecognitionModel

#: Few objects and much noise, so that posteriors of all sizes occur.
PLAN: Final = ComparisonPlan(
    n_trials=5000, n_actions=3, n_objects=8, n_remembered=5, n_learning_actions=12, parameters=ModelParameters(0.1, 0.3)
)

_N_BINS: Final = 10


@dataclass(frozen=True, eq=False)
class CalibrationRun:
    """Posteriors of many trials, and what was true in each.

    Attributes:
        posteriors: p(O | z, a) at the end of each trial, shape [T, H].
        truths: State of O that each trial was drawn with, shape [T].
        prior: p(O), shape [H].
    """

    posteriors: FloatArray
    truths: np.ndarray[Any, np.dtype[np.int64]]
    prior: FloatArray


def draw_trial(
    memory: RobotMemory, parameters: ModelParameters, n_actions: int, rng: np.random.Generator
) -> tuple[int, list[int], list[int]]:
    """Return a state of O, the patterns seen and the actions done, drawn from the model with random actions.

    With learning within the trial the tables change with what is drawn, as they do for inference.
    """
    model = RecognitionModel(memory, parameters)
    hypothesis = int(rng.choice(model.n_hypotheses, p=model.prior))
    state = int(rng.choice(model.n_states, p=model.base_row[hypothesis]))
    patterns: list[int] = []
    actions: list[int] = []
    while True:
        shows = _shown(model, hypothesis, state)
        patterns.append(int(rng.choice(len(shows), p=shows / shows.sum())))
        previous, action = (patterns[-2], actions[-1]) if actions else (None, None)
        revelation = model.learn(previous, action, patterns[-1])
        if revelation is not None and state == COLLECTION and hypothesis in revelation.hypotheses:
            found = int(np.flatnonzero(revelation.hypotheses == hypothesis)[0])
            if rng.random() < revelation.shares[found]:
                state = int(revelation.states[found])
        if len(actions) == n_actions:
            return hypothesis, patterns, actions
        actions.append(int(rng.integers(model.n_actions)))
        state = int(rng.choice(model.n_states, p=model.transition(actions[-1])[hypothesis, state]))


def _shown(model: RecognitionModel, hypothesis: int, state: int) -> FloatArray:
    """Return p(z | x, i) of every pattern, shape [|𝒵|]."""
    noise = model.parameters.observation_noise
    truth = np.zeros(model.n_patterns)
    if state == COLLECTION:
        truth = model.collection_rate[hypothesis] * model.lacks[hypothesis]
    else:
        truth[model.pattern_of[hypothesis, state]] = 1.0 - noise
    return truth + noise / model.n_patterns


def run_calibration(
    engine: str, plan: ComparisonPlan = PLAN, seed: int = 0, on_trial: Callable[[], None] | None = None
) -> CalibrationRun:
    """Draw trials from the model and infer the object of each.

    Args:
        engine: Name of the engine.
        plan: Sizes and parameters of memory and trials.
        seed: Seed of all; each trial has a generator of its own.
        on_trial: Called after each trial.
    """
    memory_seed, *trial_seeds = np.random.SeedSequence(seed).spawn(1 + plan.n_trials)
    memory = plan.learned_memory(np.random.default_rng(memory_seed))
    posteriors, truths = [], []
    identity = np.eye(len(memory.assumptions.alphabet))
    for trial_seed in trial_seeds:
        rng = np.random.default_rng(trial_seed)
        hypothesis, patterns, actions = draw_trial(memory, plan.parameters, plan.n_actions, rng)
        inference = begin_trial(engine, memory, plan.parameters)
        for look, pattern in enumerate(patterns):
            inference.observe(Evidence(identity[pattern], pattern))
            if look < len(actions):
                inference.act(actions[look])
        belief = inference.identity()
        posteriors.append([*belief.objects, belief.unseen])
        truths.append(hypothesis)
        if on_trial is not None:
            on_trial()
    model = RecognitionModel(memory, plan.parameters)
    return CalibrationRun(np.array(posteriors), np.array(truths), model.prior)


def summarise(run: CalibrationRun) -> dict[str, Any]:
    """Return the χ² test that the averaged posterior is the prior, and the reliability of the posteriors."""
    statistic, freedom = chi_square(run)
    bins = reliability(run)
    total = sum(each["count"] for each in bins)
    return {
        "trials": len(run.truths),
        "averaged_posterior": run.posteriors.mean(axis=0).tolist(),
        "prior": run.prior.tolist(),
        "chi_square": {"statistic": statistic, "degrees_of_freedom": freedom, "p": chi_square_tail(statistic, freedom)},
        "reliability": bins,
        "reliability_error": sum(each["count"] * abs(each["predicted"] - each["found"]) for each in bins) / total,
    }


def chi_square(run: CalibrationRun) -> tuple[float, int]:
    """Return the statistic of the test that the posterior averaged over the trials is the prior, and its freedom.

    The squared distance of the two in units of the average's standard error, with the covariance of the posteriors
    taken from the trials. The states' probabilities sum to one, so the last one is left out.
    """
    away = run.posteriors.mean(axis=0)[:-1] - run.prior[:-1]
    covariance = np.atleast_2d(np.cov(run.posteriors[:, :-1], rowvar=False)) / len(run.truths)
    return float(away @ np.linalg.pinv(covariance) @ away), int(np.linalg.matrix_rank(covariance))


def reliability(run: CalibrationRun) -> list[dict[str, Any]]:
    """Return, for tenths of probability, how many times it was given, its mean, and how often it was true."""
    given = run.posteriors.ravel()
    true = (np.arange(run.posteriors.shape[1]) == run.truths[:, None]).ravel()
    tenth = np.minimum((given * _N_BINS).astype(int), _N_BINS - 1)
    return [
        {
            "from": number / _N_BINS,
            "count": int(chosen.sum()),
            "predicted": float(given[chosen].mean()),
            "found": float(true[chosen].mean()),
        }
        for number in range(_N_BINS)
        if (chosen := tenth == number).any()
    ]


def chi_square_tail(statistic: float, freedom: int) -> float:
    """Return p(χ² > statistic) with ``freedom`` degrees of freedom, from its finite series."""
    half = statistic / 2
    tail = math.erfc(math.sqrt(half)) if freedom % 2 else math.exp(-half)
    exponent = 0.5 if freedom % 2 else 1.0
    while exponent < freedom / 2:
        tail += math.exp(exponent * math.log(half) - half - math.lgamma(exponent + 1)) if half > 0 else 0.0
        exponent += 1
    return min(1.0, tail)
