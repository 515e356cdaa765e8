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
# # Evidence that errs
#
# A detector mistakes one label for another, sees nothing at all, and sees the same label on several sides of an object.
# Here are eight boxes with a label on each of six sides, drawn from eight labels. One label in five is wrong, one look
# in ten shows nothing. The robot is told the labels, the actions and the number of boxes; nothing of what actions do,
# of how often the detector errs, or of what its confidences mean.

# %%
import numpy as np

import atg_fg as atg
from atg_fg.core.records import TrialSummary
from atg_fg.display.figures import GREY, PALETTE, figure_class, plot_style
from atg_fg.experiments.scores import Score
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.learning.structured_memory import memory_for
from atg_fg.worlds.detector_world import LABELS

NOISE = {"wrong": 0.2, "missing": 0.1, "confidences": True}
world = atg.make_world("detector", n_objects=8, objects_seed=0, **NOISE)
learned = atg.preset("learned")

# %% [markdown]
# ## What the robot sees
#
# One trial of eight actions: what the detector says, how sure it says it is, and what is really there.

# %%
memory = memory_for(learned, atg.RobotMemory(world.unwrapped.assumptions))
inference = atg.begin_trial("learned-structure", memory, learned)
record = run_trial(world, inference, atg.make_policy("random"), 8, np.random.default_rng(0))
for look, step in enumerate(record.steps):
    (label,), (confidence,), (truth,) = step.detection, step.confidences, step.truth["pattern"]
    said = "nothing" if label is None else f"{LABELS[label]} ({confidence:.2f})"
    note = "" if label in (None, truth) else f"   wrong: it is {LABELS[truth]}"
    print(f"look {look}: {said}{note}")

# %% [markdown]
# ## Forty trials, from an empty memory
#
# After each trial all raw trials are sampled again: which of them are of one object, where each began, where actions
# lead, how often labels are wrong. So a later trial can mend the verdict of an earlier one.


# %%
def verdicts(parameters, engine):
    """Return whether each of 40 verdicts was right when it was given, and the memory in the end."""
    memory, score, rights = memory_for(parameters, atg.RobotMemory(world.unwrapped.assumptions)), Score(), []
    for number in range(40):
        inference = atg.begin_trial(engine, memory, parameters)
        record = run_trial(world, inference, atg.make_policy("entropy"), 8, np.random.default_rng(number))
        score.add(TrialSummary.of(record), learn_from(record, memory), memory)
        score.mend(memory)
        rights.append(score.successes - sum(rights))
    return np.array(rights), memory


rights = {}
rights["learned"], memory = verdicts(learned, "learned-structure")
rights["default"], _ = verdicts(atg.preset("default"), "bayes-filter")
print({name: f"{100 * right.mean():.0f} % right" for name, right in rights.items()})

# %%
with plot_style():
    figure = figure_class()(figsize=(6.0, 2.8), layout="constrained")
    axes = figure.subplots()
    for color, (name, right) in zip(PALETTE, rights.items(), strict=False):
        axes.plot(np.arange(1, 41), np.cumsum(right), color=color, label=name)
    axes.plot([1, 40], [1, 40], color=GREY, linewidth=0.8, linestyle="dotted")
    axes.set(xlabel="trials", ylabel="right verdicts so far")
    axes.legend(frameon=False)
figure

# %% [markdown]
# ## Verdicts that were mended
#
# A raw trial that turns out to be of another object goes to the ATG of that one. It is on record, and can be undone.

# %%
print(len(memory.reassignments), "raw trials changed hands; the first of them:")
for each in memory.reassignments[:6]:
    print(f"after {each.after} trials: trial {each.trial} from {each.old} to {each.new}")

# %% [markdown]
# ## What a confidence means
#
# The detector's numbers are no probabilities: 0.55 may be a right label or a wrong one. In bins of equally many looks
# the robot learns how often a label is right; here is that beside the truth, which it was never told.

# %%
noise = memory.evidence.noise
middles = np.concatenate(([0.4], (noise.edges[1:] + noise.edges[:-1]) / 2, [0.95]))
density = 0.7 / 0.48 * ((middles >= 0.5) & (middles <= 0.98)), 0.2 / 0.35 * ((middles >= 0.35) & (middles <= 0.7))
with plot_style():
    figure = figure_class()(figsize=(6.0, 2.8), layout="constrained")
    axes = figure.subplots()
    axes.plot(middles, noise.right, "o-", color=PALETTE[0], label="learned")
    axes.plot(middles, density[0] / (density[0] + density[1]), "s", color=GREY, label="truth")
    axes.set(xlabel="confidence", ylabel="p(label is right)", ylim=(0, 1.05))
    axes.legend(frameon=False)
figure

# %% [markdown]
# ## Where it fails
#
# Most errors are made early, while neither the boxes' sides nor the detector are known, and with labels alone: then a
# fifth of wrong labels is not told from right ones. Three tests of 48 trials:

# %%
plan = TestPlan(
    world="detector",
    world_options={"wrong": 0.2, "missing": 0.1},
    engine="learned-structure",
    parameters=learned,
    n_actions=8,
    n_trials=48,
    n_objects=8,
)
for seed in (100, 101, 102):
    result = run_test(plan, seed)
    print(f"seed {seed}: {result.success[0]} of 48 right when given, {result.mended[0]} after mending")
