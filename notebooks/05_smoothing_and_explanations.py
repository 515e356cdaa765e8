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
# # Smoothing and explanations
#
# A filter says what is believed now. The trial's factor graph also says what is believed *now* about what was seen
# *then*; which objects and aspects together explain everything best; and how surprising each look was. This notebook
# takes one noisy trial and asks all of these.

# %%
import numpy as np

import atg_fg as atg
from atg_fg.core.statistics import wilson_interval
from atg_fg.display.figures import GREY, PALETTE, figure_class, plot_style
from atg_fg.experiments.engine_comparison import ComparisonPlan
from atg_fg.inference.explanations import best_explanations, sample_explanations, surprise
from atg_fg.inference.smoothing import pattern_marginals, smoothed_patterns

# %% [markdown]
# ## A trial with a wrong look and a missing one
#
# Three cubes are remembered, each turned at random twenty times (seed 0). A trial with the first one follows edges that
# its ATG knows; but the third look shows a pattern that is not there, and the fourth misses the top. The model assumes
# some noise.

# %%
parameters = atg.ModelParameters(transition_concentration=0.05, observation_noise=0.05, learn_in_trial=False)
plan = ComparisonPlan(n_objects=10, n_remembered=3, n_learning_actions=20, parameters=parameters)
memory = plan.learned_memory(np.random.default_rng(0))
graph = memory[memory.names[0]]
patterns = memory.assumptions.alphabet.patterns
known = [patterns[index] for index in graph.pattern_indices]
# A walk along counted edges, always the first that leads to another aspect.
path, actions = [0], []
while len(path) < 6:
    steps = [(action, target) for (source, action, target) in graph.counts if source == path[-1]]
    action, target = next(step for step in steps if step[1] not in path[-2:])
    actions.append(action)
    path.append(target)
shown = [known[aspect] for aspect in path]

# %%
seen = list(shown)
seen[2] = next(p for p in patterns if p not in known and not set(p) & set(shown[2]))
seen[3] = (shown[3][0], None)
for time, (true, look) in enumerate(zip(shown, seen, strict=True)):
    print(
        f"look {time}: shows {true}, seen {look}"
        + ("" if time == 5 else f", then {memory.assumptions.actions[actions[time]]}")
    )

# %%
inference = atg.begin_trial("gtsam", memory, parameters)
for time, look in enumerate(seen):
    inference.observe(atg.Evidence.of_detection(memory.assumptions.alphabet, look))
    if time < len(actions):
        inference.act(actions[time])
belief = inference.identity()
print(
    {name: round(float(p), 4) for name, p in zip(memory.names, belief.objects, strict=True)},
    f"unseen {belief.unseen:.4f}",
)

# %% [markdown]
# ## Surprise
#
# $-\ln p(z_t \mid z_{0:t-1}, a_{1:t})$ of each look. They sum to minus the log evidence of the trial. The wrong look
# stands out; the one that misses a symbol says little, so it surprises little.

# %%
chain = inference.chain()
surprises = surprise(chain)
assert abs(surprises.sum() + inference.log_evidence) < 1e-9
with plot_style():
    figure = figure_class()(figsize=(6.0, 2.6), layout="constrained")
    axes = figure.subplots()
    colours = [PALETTE[1] if time == 2 else PALETTE[4] if time == 3 else PALETTE[0] for time in range(6)]
    axes.bar(range(6), surprises, color=colours, width=0.6)
    axes.set(xlabel="look", ylabel="nats", title="Surprise of each look (2 is wrong, 3 is partial)")
figure

# %% [markdown]
# ## Explanations
#
# An explanation is an object and an aspect for every look. The most probable one (MPE) tells the whole story; the next
# ones tell what else it may have been, and how much less probable. `collection` is an aspect the ATG does not know.


# %%
def told(explanation):
    """An explanation in words."""
    names = inference.model.pattern_of[explanation.hypothesis]
    aspects = [str(patterns[names[state]]) if names[state] >= 0 else "collection" for state in explanation.states]
    return f"{explanation.probability:.4f}  {(*memory.names, 'unseen')[explanation.hypothesis]}: " + " → ".join(aspects)


for explanation in best_explanations(chain, 4):
    print(told(explanation))

# %% [markdown]
# The MPE names the object, puts the wrong look right and fills in the partial one.

# %%
best = best_explanations(chain)[0]
names = inference.model.pattern_of[best.hypothesis]
assert (best.hypothesis, [patterns[names[state]] for state in best.states]) == (0, shown)

# %% [markdown]
# Samples come from the same posterior. Of 1,000 draws (seed 0), the shares of the most frequent stories are near their
# probabilities; lines are 95 % Wilson intervals.

# %%
drawn = [(each.hypothesis, each.states) for each in sample_explanations(chain, 1000, np.random.default_rng(0))]
with plot_style():
    figure = figure_class()(figsize=(6.0, 2.4), layout="constrained")
    axes = figure.subplots()
    for place, explanation in enumerate(best_explanations(chain, 4)):
        count = drawn.count((explanation.hypothesis, explanation.states))
        low, high = wilson_interval(count, len(drawn))
        axes.bar(place, explanation.probability, color=PALETTE[0], alpha=0.4, width=0.6)
        axes.plot([place, place], [low, high], color=PALETTE[1], linewidth=2)
        axes.plot(place, count / len(drawn), "o", color=PALETTE[1])
    axes.set(xticks=range(4), xlabel="explanation, the most probable first", ylabel="probability")
    axes.set(yscale="log", ylim=(1e-4, 2), title="Probability (bar) and share of samples (dot)")
figure

# %% [markdown]
# ## Filtered and smoothed
#
# Below, the probability of the pattern that was truly shown: given the evidence up to that look (filtered), and given
# all of it (smoothed). What comes later settles what was open.


# %%
def true_pattern_probabilities(looks):
    """p(true pattern at each look | object 0, the first ``looks`` looks)."""
    part = atg.begin_trial("bayes-filter", memory, parameters)
    for time in range(looks):
        part.observe(atg.Evidence.of_detection(memory.assumptions.alphabet, seen[time]))
        if time < looks - 1:
            part.act(actions[time])
    return [row[patterns.index(true)] for row, true in zip(pattern_marginals(part, 0), shown, strict=False)]


# %%
filtered = [true_pattern_probabilities(time + 1)[time] for time in range(6)]
smoothed = true_pattern_probabilities(6)
with plot_style():
    figure = figure_class()(figsize=(6.0, 2.8), layout="constrained")
    axes = figure.subplots()
    axes.plot(filtered, "o--", color=GREY, label="filtered")
    axes.plot(smoothed, "o-", color=PALETTE[0], label="smoothed")
    axes.set(xlabel="look", ylabel="probability", ylim=(-0.03, 1.06), title="Probability of the pattern truly shown")
    axes.legend(loc="lower left")
figure

# %% [markdown]
# ## Learning from it
#
# A memory that learns from raw patterns would add the wrong pattern to the ATG, and skip the partial look with both its
# edges. Learning from smoothed patterns takes what is at least 95 % probable given everything.

# %%
raw = [atg.Evidence.of_detection(memory.assumptions.alphabet, look).pattern for look in seen]
for time, pair in enumerate(zip(raw, smoothed_patterns(inference, 0), strict=True)):
    one, other = (None if pattern is None else patterns[pattern] for pattern in pair)
    print(f"look {time}: raw {one}, smoothed {other}")
