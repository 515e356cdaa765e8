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
import json
from pathlib import Path

import numpy as np

from atg_fg import TestPlan, arcube_assumptions, preset, run_test
from atg_fg.display.completed_picture import draw_completed_atg
from atg_fg.display.figures import GREY, PALETTE, figure_class, plot_style
from atg_fg.display.structure_picture import draw_structure
from atg_fg.display.structure_words import action_text, register_names
from atg_fg.display.success_plots import plot_ablation
from atg_fg.experiments.exploration import learned_memory
from atg_fg.learning.completion import completed_atg, statuses
from atg_fg.policies import RandomPolicy
from atg_fg.worlds.arcube import make_arcubes

assumptions = arcube_assumptions()
cubes = make_arcubes(8, seed=0)

# %% [markdown]
# ## The structure emerges
#
# A memory learns trial by trial, each with another cube and 10 random actions. After every trial: the best structure's
# registers and poses, and how many nats it explains the trials better than plain ATGs do, its prior included.

# %%
for n_trials in (1, 2, 3, 5, 8):
    memory = learned_memory(
        assumptions, cubes[:n_trials], RandomPolicy(), 10, np.random.default_rng(0), parameters=preset("learned")
    )
    found = memory.learner.candidates
    best = f"{found[0].n_registers} registers, {len(found[0].poses().registers)} poses" if found else "none"
    print(f"{n_trials} trials: {best}; gain {max(memory.learner.gain, 0.0):.1f} nats")

# %%
structure = memory.learner.candidates[0]
names = register_names(structure, assumptions.alphabet.slots)
for action, sources in zip(assumptions.actions, structure.sources, strict=True):
    print(f"{action}: {action_text(sources, names)}")
draw_structure(structure, assumptions)

# %% [markdown]
# Six registers, two of them in view, and 24 poses: the rotations of a cube, found from what was seen in a few trials.
#
# ## A completed ATG
#
# The ATG of a cube that was turned over in ten actions, and what the structure says of the rest: aspects never seen,
# and where actions never tried lead.

# %%
completed = completed_atg(memory, memory.names[0])
print({status: count for status, count in statuses(completed).items() if count})
draw_completed_atg(completed, assumptions)

# %% [markdown]
# ## What it is worth
#
# The paper's Figure 3 with all models, under four kinds of noise: 10 tests of 100 trials a point, seeds 0 to 9, entropy
# policy, 95 % Wilson intervals. The curves are read from what `make results-structure` has left.

# %%
cells = json.loads(Path("../results/ablation.json").read_text())["cells"]
plot_ablation(cells)

# %%
for noise in dict.fromkeys(cell["noise"] for cell in cells):
    for variant in ("paper", "default", "learned"):
        row = {c["actions"]: c for c in cells if (c["variant"], c["noise"], c["world"]) == (variant, noise, "ideal")}
        shares = (f"{n}: {100 * cell['success']:5.1f}" for n, cell in row.items() if n in (4, 6, 10, 20))
        print(f"{noise:>20} {variant:>8}  " + "  ".join(shares))

# %% [markdown]
# ## Is the belief right?
#
# A model that counts a repeated edge as fresh evidence is too sure of itself. Of all trials in which the posterior of
# *unseen* was in a tenth at the end, how many objects were new? Two tests of 100 trials for each model, seeds 0 and 1,
# 6 actions; a calibrated model is on the diagonal.


# %%
def novelty(name, engine):
    """The posterior of unseen at the end of each trial, and whether the object was new."""
    posterior, new = [], []
    for seed in (0, 1):
        met = set()

        def keep(_, record, met=met):
            number = record.steps[0].truth["object"]
            posterior.append(record.belief.unseen)
            new.append(number not in met)
            met.add(number)

        run_test(TestPlan(engine=engine, parameters=preset(name), n_actions=6), seed, on_trial=keep)
    return np.array(posterior), np.array(new)


models = {"paper": "bayes-filter", "default": "bayes-filter", "learned": "learned-structure"}
novelties = {name: novelty(name, engine) for name, engine in models.items()}
for name, (posterior, new) in novelties.items():
    surprise = -np.log(np.clip(np.where(new, posterior, 1 - posterior), 1e-12, None)).mean()
    print(f"{name:>8}: Brier score {np.mean((posterior - new) ** 2):.3f}, mean surprise {surprise:.2f} nats")

# %%
with plot_style():
    figure = figure_class()(figsize=(5.2, 3.6), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color=GREY, linewidth=1, linestyle="--")
    edges = np.array([0.0, 0.01, 0.2, 0.5, 0.8, 0.99, 1.0])
    for rank, (name, (posterior, new)) in enumerate(novelties.items()):
        bins = np.clip(np.digitize(posterior, edges) - 1, 0, len(edges) - 2)
        held = [number for number in range(len(edges) - 1) if (bins == number).any()]
        told, true = zip(*[(posterior[bins == b].mean(), new[bins == b].mean()) for b in held], strict=True)
        sizes = [20 + 2 * (bins == b).sum() for b in held]
        axes.scatter(told, true, s=sizes, color=PALETTE[rank], label=name, alpha=0.8)
    axes.set(xlabel="posterior of unseen", ylabel="share that was new", title="Novelty, told and true")
    axes.legend(markerscale=0.5)
figure

# %% [markdown]
# The area of a dot grows with its trials. *Surprise* is what the truth cost each model on the mean: one that is sure
# and wrong pays most.
