"""A trial of a plain ATG, followed by every path in exact fractions."""

from fractions import Fraction

from atg_fg.core.aspect_graph import AspectTransitionGraph
from tests.oracle import Atg, Oracle


def followed(assumptions, before, trial, noise):
    """Return the oracle after a trial, where the trials before it made one ATG, or none if there are none."""
    alphabet, graph = assumptions.alphabet, AspectTransitionGraph("it", assumptions)
    for earlier in before:
        graph.learn([alphabet.index(look) for look in earlier.detections], earlier.actions)
    known = list(graph.aspects)
    counts = {(known[x], action, known[y]): n for (x, action, y), n in graph.counts.items()}
    alpha, delta = (Fraction(str(each)) for each in noise)
    oracle = Oracle(
        n_objects=assumptions.n_objects,
        n_aspects=assumptions.n_aspects,
        n_actions=len(assumptions.actions),
        patterns=alphabet.patterns,
        graphs=[Atg(known, counts)] if before else [],
        alpha=alpha,
        delta=delta,
        learn_in_trial=True,
    )
    for time, look in enumerate(trial.detections):
        if time:
            oracle.act(trial.actions[time - 1])
        oracle.observe({z: Fraction(z == look) for z in oracle.Z}, look)
    return oracle
