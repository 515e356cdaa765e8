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
# # Beyond the paper
#
# In the paper every object is learned by itself: an action never tried may lead to any of the 132 patterns. But after a
# *flip* the new front is always the old top, of every cube. This notebook shows what is gained by learning what all
# objects share: registers that hold an object's symbols, and what each action makes of them. Nothing is told
# about cubes.

# %%
import numpy as np

import atg_fg as atg
from atg_fg.core.statistics import wilson_interval
from atg_fg.display.completed_picture import draw_completed_atg
from atg_fg.display.figures import GREY, PALETTE, figure_class, plot_style
from atg_fg.display.structure_picture import draw_structure
from atg_fg.experiments.exploration import learned_memory
from atg_fg.learning.completion import completed_atg
from atg_fg.storage.packaged import packaged_result

assumptions = atg.arcube_assumptions()
cubes = atg.make_arcubes(8, seed=0)

# %% [markdown]
# ## The structure emerges
#
# A memory learns trial by trial, each with another cube and 10 random actions. After some of them: the best structure's
# registers and poses, and how many nats it explains the trials better than plain ATGs do, its prior included.

# %%
gains = {}
for n_trials in (1, 2, 3, 5, 8):
    policy, rng = atg.make_policy("random"), np.random.default_rng(0)
    memory = learned_memory(assumptions, cubes[:n_trials], policy, 10, rng, parameters=atg.preset("learned"))
    found = memory.learner.candidates
    best = f"{found[0].n_registers} registers, {len(found[0].poses().registers)} poses" if found else "no structure"
    gains[n_trials] = max(memory.learner.gain, 0.0), best

# %%
with plot_style():
    figure = figure_class()(figsize=(6.0, 2.8), layout="constrained")
    axes = figure.subplots()
    axes.plot(list(gains), [gain for gain, _ in gains.values()], "o-", color=PALETTE[0])
    for best, (n_trials, gain) in {best: (n, gain) for n, (gain, best) in reversed(gains.items())}.items():
        axes.annotate(best, (n_trials, gain), (0, 7), textcoords="offset points", ha="right", fontsize=8, color=GREY)
    axes.set(xlabel="trials", ylabel="nats better than plain ATGs", xlim=(-0.6, 8.4))
    axes.margins(y=0.2)
    axes.set_title("The structure emerges (one memory, seed 0)")
figure

# %%
draw_structure(memory.learner.candidates[0], assumptions)

# %% [markdown]
# Six registers, two of them in view, and 24 poses: the rotations of a cube, found from what was seen in a few trials.
#
# ## A completed ATG
#
# The ATG of a cube that was turned over in ten actions, and what the structure says of the rest: aspects never seen,
# and where actions never tried lead.

# %%
draw_completed_atg(completed_atg(memory, memory.names[0]), assumptions)

# %% [markdown]
# ## What it is worth
#
# The paper's Figure 3 with all models, under four kinds of noise: 10 tests of 100 trials a point, seeds 0 to 9, entropy
# policy, 95 % Wilson intervals. The curves are read from what `make results-structure` has left.

# %%
cells = packaged_result("ablation")["cells"]
atg.plot_ablation(cells)

# %% [markdown]
# ## Is the belief right?
#
# A model that counts a repeated edge as fresh evidence is too sure of itself. Of all trials in which the posterior of
# *unseen* was in a tenth at the end, how many objects were new? Two tests of 100 trials for each model, seeds 0 and 1,
# 6 actions; a calibrated model is on the diagonal.


# %%
def novelty(name, engine):
    """The posterior of unseen at the end of each trial, and whether the object was new."""
    told = []
    for seed in (0, 1):
        met = set()

        def keep(_, record, met=met):
            number = record.steps[0].truth["object"]
            told.append((record.belief.unseen, number not in met))
            met.add(number)

        plan = atg.TestPlan(engine=engine, parameters=atg.preset(name), n_actions=6)
        atg.run_test(plan, seed, on_trial=keep)
    return np.array(told).T


engines = {"paper": "bayes-filter", "default": "bayes-filter", "learned": "learned-structure"}
novelties = {name: novelty(name, engine) for name, engine in engines.items()}

# %%
for name, (posterior, new) in novelties.items():
    surprise = -np.log(np.clip(np.where(new, posterior, 1 - posterior), 1e-12, None)).mean()
    print(f"{name:>8}: Brier score {np.mean((posterior - new) ** 2):.3f}, mean surprise {surprise:.2f} nats")


# %%
def in_bins(posterior, new, edges=(0.0, 0.01, 0.2, 0.5, 0.8, 0.99, 1.0)):
    """The mean posterior, the share that was new with its 95 % interval, and the number of trials, in each bin."""
    bins = np.clip(np.digitize(posterior, edges) - 1, 0, len(edges) - 2)
    for number in np.unique(bins):
        held = new[bins == number]
        yield posterior[bins == number].mean(), held.mean(), wilson_interval(int(held.sum()), len(held)), len(held)


with plot_style():
    figure = figure_class()(figsize=(7.4, 3.0), layout="constrained")
    for axes, color, (name, each) in zip(figure.subplots(1, 3, sharey=True), PALETTE, novelties.items(), strict=False):
        axes.plot([0, 1], [0, 1], color=GREY, linewidth=1, linestyle="--")
        for told, true, interval, n_trials in in_bins(*each):
            axes.plot([told, told], interval, color=color, linewidth=1.5, alpha=0.6)
            axes.scatter(told, true, s=12 + n_trials, color=color)
        axes.set(title=name, xlabel="posterior of unseen", xlim=(-0.06, 1.06))
    figure.axes[0].set_ylabel("share that was new")
figure

# %% [markdown]
# Bars are 95 % Wilson intervals; the area of a dot grows with its trials. *Surprise* is what the truth cost each model
# on the mean: one that is sure and wrong pays most.
