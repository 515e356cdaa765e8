"""Trials of fresh objects, summed over all they may contain: what the filter approximates, for small structures."""

import itertools

import numpy as np

from atg_fg.core.patterns import Evidence
from atg_fg.inference.chain import forward_pass
from atg_fg.inference.history import History
from atg_fg.learning.pose_chain import pose_chain


def completions(structure, alphabet):
    """Return all contents with a different symbol in each register, each of the same probability, shape [H, P, S]."""
    symbols = np.array(list(itertools.permutations(range(alphabet.n_symbols), structure.n_registers)), dtype=np.int64)
    return np.eye(alphabet.n_symbols)[symbols]


def exact_log_evidence(structure, trial, rates, alphabet):
    """Return ln p(trial | structure, a fresh object without repeated symbols)."""
    contents = completions(structure, alphabet)
    history = History([Evidence.of_detection(alphabet, each) for each in trial.detections], list(trial.actions))
    prior = np.full(len(contents), 1.0 / max(len(contents), 1))
    joint = forward_pass(pose_chain(structure.poses(), contents, prior, rates, alphabet, history)).log_joint
    return float(np.logaddexp.reduce(joint))
