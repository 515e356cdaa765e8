# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#       format_version: '1.3'
#       jupytext_version: 1.19.6
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Recognition as a factor graph
#
# The paper infers identity with a Bayes filter over the aspects of all objects. The same posterior is a marginal of a
# discrete factor graph over the object $O$ and the aspects $X_0, \dots, X_t$:
#
# $$p(O, X_{0:t}, z_{0:t} \mid a_{1:t}) = p(O)\; p(X_0 \mid O) \prod_{s=1}^{t} p(X_s \mid X_{s-1}, a_s, O)
# \prod_{s=0}^{t} p(z_s \mid X_s, O).$$
#
# The graph gives more than the filter: marginals of past aspects, and expected entropy (eq. 3 of the paper) as the
# marginal of a graph with one more action and one more observation. This notebook takes one trial and checks each
# claim with an assertion.

# %%
import time

import numpy as np

import atg_fg as atg
from atg_fg.display.figures import PALETTE, figure_class, plot_style
from atg_fg.inference.gtsam_factors import object_key

# %% [markdown]
# ## Three look-alikes and a small memory
#
# Three cubes have the same six tags. Cube 1 is the mirror image of cube 0: top and bottom are exchanged, so it shows
# the very same 24 patterns, and only what actions do tells the two apart. Cube 2 has two sides exchanged. The robot
# knows 12 random actions with each (seeds 0, 1, 2) and that there is one more object it has never met.

# %%
cubes = ((0, 1, 2, 3, 4, 5), (0, 1, 2, 3, 5, 4), (0, 2, 1, 3, 4, 5))
assumptions = atg.arcube_assumptions(n_objects=4)
memory = atg.RobotMemory(assumptions)
ideal = atg.make_world("ideal", cubes=cubes)
for cube in range(3):
    inference = atg.begin_trial("bayes-filter", atg.RobotMemory(assumptions), atg.ModelParameters())
    rng = np.random.default_rng(cube)
    record = atg.run_trial(ideal, inference, atg.make_policy("random"), 12, rng, reset_options={"object": cube})
    memory.learn(record.patterns, record.actions, matched=None)
memory

# %% [markdown]
# ## One trial in a noisy world
#
# Cube 1 is presented (seed 0) in a world where one action in ten fails and one look in five shows a wrong pattern. The
# model assumes such noise: $\alpha = \delta = 0.1$. It does not learn within the trial here, so that the states of
# $X_s$ are those of the ATGs. The robot takes the action of least expected entropy, five times.

# %%
parameters = atg.ModelParameters(transition_concentration=0.1, observation_noise=0.1, learn_in_trial=False)
world = atg.make_world("ideal", cubes=cubes, slip=0.1, wrong=0.2)
inference = atg.begin_trial("gtsam", memory, parameters)
rng = np.random.default_rng(0)
record = atg.run_trial(world, inference, atg.make_policy("entropy"), 5, rng, reset_options={"object": 1})
for number, step in enumerate(record.steps):
    remarks = [f"wrong, should be {step.truth['pattern']}"] * (step.detection != step.truth["pattern"])
    remarks += ["the action had failed"] * step.truth["slipped"]
    action = "" if step.action is None else f"then {assumptions.actions[step.action]}"
    print(f"look {number}: {step.detection!s:9} {action:11} {'; '.join(remarks)}".rstrip())

# %% [markdown]
# ## Its factor graph
#
# To the right of $O$: its prior. Above $X_0$: $p(X_0 \mid O)$. Between two aspects: the action. Below each aspect: what
# was seen. Every factor has $O$ among its variables, since the memory holds a different ATG for each object.

# %%
graph = inference.graph()
graph

# %%
for index in range(graph.graph.size()):
    print(f"factor {index:2} on", ", ".join(graph.names_of(index)))

# %% [markdown]
# ## The marginal of $O$ is what the Bayes filter computes
#
# Three independent ways to $p(O \mid z_{0:5}, a_{1:5})$: eliminating the whole graph with GTSAM; the recursive Bayes
# filter; and enumerating all $4 \cdot 10^6$ joint states of $(O, X_0, \dots, X_5)$, which is possible only since the
# memory is small and the trial is short. Beside them, GTSAM's own `DiscreteMarginals`, and the engine that eliminates
# step by step with GTSAM.


# %%
def identity_by(engine: str) -> np.ndarray:
    """Return p(O | z, a) of the recorded trial by another engine."""
    other = atg.begin_trial(engine, memory, parameters)
    for evidence, action in zip(inference.history.evidence, [*inference.history.actions, None], strict=True):
        other.observe(evidence)
        if action is not None:
            other.act(action)
    belief = other.identity()
    return np.append(belief.objects, belief.unseen)


# %%
eliminated = np.append(graph.identity().objects, graph.identity().unseen)
posteriors = {
    "whole graph, eliminated": eliminated,
    "DiscreteMarginals": np.array(graph.marginals().marginalProbabilities(graph.variable(object_key()))),
    "Bayes filter": identity_by("bayes-filter"),
    "enumeration": identity_by("enumeration"),
    "engine 'gtsam', step by step": identity_by("gtsam"),
}
for name, posterior in posteriors.items():
    difference = np.abs(posterior - eliminated).max()
    print(f"{name:30} {np.round(posterior, 4)}  largest difference {difference:.0e}")
    assert difference <= 1e-12

# %% [markdown]
# ## Belief over identity
#
# The first look cannot tell the mirror images apart. Actions can. The failed action and the wrong look cost certainty,
# and the last look restores it. One trial, seed 0; the posterior is exact, so there is no interval to give.

# %%
atg.plot_belief(record)

# %%
inference.belief_table()

# %% [markdown]
# ## Aspects: filtered and smoothed
#
# Given the object, the marginal of $X_s$ is *filtered* if it uses evidence up to time $s$, and *smoothed* if it uses
# all of it. The smoothed marginals come from the same graph, eliminated from both ends of the chain towards $X_s$. The
# columns are the known aspects of cube 1's ATG by their tags (front, top), and $C$, its collection node; a circle marks
# the truth.

# %%
truth = memory["object-001"]
position = memory.names.index("object-001")
prefixes = []
prefix = atg.begin_trial("gtsam", memory, parameters)
for evidence, action in zip(inference.history.evidence, [*inference.history.actions, None], strict=True):
    prefix.observe(evidence)
    prefixes.append(prefix.graph())
    if action is not None:
        prefix.act(action)


def given_object(joint: np.ndarray) -> np.ndarray:
    """Return p(X | O = cube 1) from p(O, X)."""
    return joint[position] / joint[position].sum()


filtered = np.array([given_object(prefixes[s].aspect_marginal(s)) for s in range(6)])
smoothed = np.array([given_object(graph.aspect_marginal(s)) for s in range(6)])
assert np.abs(filtered[-1] - smoothed[-1]).max() <= 1e-12  # at the last time they are the same

# %%
true_aspects = [truth.aspect_showing(assumptions.alphabet.index(step.truth["pattern"])) for step in record.steps]
true_states = [0 if aspect is None else 1 + aspect for aspect in true_aspects]
with plot_style():
    figure = figure_class()(figsize=(9, 3.6), layout="constrained")
    for axes, (name, table) in zip(
        figure.subplots(1, 2, sharey=True), {"Filtered": filtered, "Smoothed": smoothed}.items(), strict=True
    ):
        image = axes.imshow(table, cmap="Blues", vmin=0, vmax=1, aspect="auto")
        axes.plot(true_states, range(6), "o", markersize=13, markerfacecolor="none", markeredgecolor=PALETTE[1])
        labels = ["C", *(f"{front},{top}" for front, top in truth.aspects)]
        axes.set_xticks(range(len(labels)), labels)
        axes.set(title=f"{name}: p(X | O = cube 1, …)", xlabel="aspect (front, top)")
        axes.grid(False)
    figure.axes[0].set_yticks(range(6), [f"X{s}" for s in range(6)])
    figure.colorbar(image, ax=figure.axes, label="probability")
figure

# %%
for s in range(6):
    print(f"p(X{s} = truth): filtered {filtered[s, true_states[s]]:.3f}, smoothed {smoothed[s, true_states[s]]:.3f}")

# %% [markdown]
# Smoothing mends the wrong look: with the look after it, $X_4$ is clear. It also puts $X_2$ in doubt again, rightly so
# given the evidence: the same pattern before and after a flip means that the action failed, or that look 2 was wrong
# and the cube had stood as (4, 0), from where a flip is known to lead to (0, 5).

# %% [markdown]
# ## Expected entropy: a hypothetical action and observation, added as factors
#
# For eq. 3 one more action and one more observation are *added* to the graph. This is the graph of one hypothesis,
# "flip, then see pattern 0":

# %%
model = inference.model
patterns = np.eye(len(assumptions.alphabet))
observations = np.array([model.likelihood(atg.Evidence.of_likelihood(assumptions.alphabet, row)) for row in patterns])
hypothetical = graph.copy()
hypothetical.act(model.transition(assumptions.action_index("flip")))
hypothetical.observe(observations[0])
print(f"H(O) now {graph.identity().entropy:.4f} nats; if so {hypothetical.identity().entropy:.4f} nats")
hypothetical

# %% [markdown]
# Averaged over all 132 patterns by their predictive probability, this is the expected entropy of one action. The engine
# gets the same numbers without making $3 \cdot 132$ graphs: given $O$, the patterns that an object does not know have
# one probability in common, as have the known ones that no counted edge leads to, so it eliminates one small factor for
# each object. It also goes on from the belief about $X_t$, where each of the graphs is eliminated from the first look.
# Both are measured here, side by side, on this small memory.

# %%
started = time.perf_counter()
straightforward = np.array(
    [graph.expected_entropy_by_elimination(model.transition(a), observations) for a in range(model.n_actions)]
)
straightforward_time = time.perf_counter() - started
repeats = 20
started = time.perf_counter()
for _ in range(repeats):
    by_engine = inference.expected_entropies()
engine_time = (time.perf_counter() - started) / repeats

for action, graphs, engine in zip(assumptions.actions, straightforward, by_engine, strict=True):
    print(f"{action:6} {graphs:.6f} nats by {len(patterns)} graphs, {engine:.6f} by the engine")
assert np.abs(straightforward - by_engine).max() <= 1e-12
print(f"largest difference {np.abs(straightforward - by_engine).max():.0e}")
print(f"the straightforward way takes about {straightforward_time / engine_time:.0f} times as long")

# %% [markdown]
# ## What the planner expected, and what came
#
# Expected entropy is an average over what may be seen; the entropy that follows lies above or below it.

# %%
atg.plot_entropy(record)
