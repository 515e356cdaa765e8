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
# # Inference methods compared
#
# One model, many ways to infer. The exact engines give the posterior of the model; the others trade some of it for
# something else. Here all of them follow the same trials, look by look, and are held against an exact one. Their
# error is the total variation between the two beliefs over identity: the most by which the probability of any
# statement about the object can differ.

# %%
import numpy as np

import atg_fg as atg
from atg_fg.display.figures import GREY, PALETTE, figure_class, plot_style
from atg_fg.experiments.engine_comparison import ComparisonPlan, compare, summarise, total_variation

# %% [markdown]
# ## The trials
#
# Eight cubes exist, five are remembered. The model assumes noise, $\alpha = \delta = 0.1$, and the world has some:
# one action in twenty fails, one look in twenty shows a wrong pattern. So beliefs stay in between, where methods
# differ. All is drawn from seed 0.

# %%
plan = ComparisonPlan(
    n_trials=8,
    n_actions=3,
    n_objects=8,
    n_remembered=5,
    n_learning_actions=8,
    parameters=atg.ModelParameters(0.1, 0.1),
    world_options={"slip": 0.05, "wrong": 0.05},
)
records = compare(plan, list(atg.ENGINES), seed=0)
summary = summarise(records)
print(f"{'engine':<18} {'exact':<6} {'mean error':>10} {'worst':>10} {'same decision':>14} {'time ratio':>11}")
for engine, entry in summary.items():
    distance, same = entry["total_variation"], entry["same_decision"]
    print(
        f"{engine:<18} {'yes' if entry['exact'] else 'no':<6} {distance['mean']:>10.1e} {distance['worst']:>10.1e} "
        f"{same['rate']:>14.0%} {entry['time_ratio']['median']:>11.1f}"
    )

# %% [markdown]
# The exact engines differ by rounding only, and take the same decisions. *Same decision* is the share of looks after
# which an engine's best action is one of the best by the exact expected entropies. Times are ratios to
# `bayes-filter`, measured in turn on this machine; they are not the same elsewhere.

# %%
assert all(entry["total_variation"]["worst"] < 1e-12 for entry in summary.values() if entry["exact"])
assert all(entry["same_decision"]["rate"] == 1 for entry in summary.values() if entry["exact"])

# %% [markdown]
# ## Error against cost
#
# The particle filter and Gibbs sampling converge to the exact posterior with more samples. Loopy belief propagation is
# a fixed point of local messages; the object is a neighbour of every factor, so messages go round in circles and the
# result is biased. Mean field forgets what object and aspect tell about each other, which in this model is much.

# %%
off = {engine: record for engine, record in records.items() if record.total_variation.max() > 1e-9}
atg.plot_comparison(off, title="Mean error with 95 % interval, quartiles of the time")

# %% [markdown]
# ## More particles, less error
#
# The error of a particle filter falls as $1/\sqrt{n}$: the dashed line. One trial of four looks, thirty runs for each
# number of particles (seeds 0 to 29), each held against the exact belief. Dots are means, bars their 95 % intervals.

# %%
memory = plan.learned_memory(np.random.default_rng(0))
world = atg.make_world("ideal", cubes=atg.make_arcubes(plan.n_objects, seed=0))
observation, _ = world.reset(seed=0, options={"object": 2})
course = []
for action in (0, 1, 0, 2):
    course.append((atg.Evidence.of_detection(memory.assumptions.alphabet, tuple(observation)), action))
    observation, *_ = world.step(np.int64(action))


def after_the_course(engine, **options):
    """An engine that has looked four times."""
    inference = atg.begin_trial(engine, memory, plan.parameters, **options)
    for look, (evidence, action) in enumerate(course):
        inference.observe(evidence)
        if look < len(course) - 1:
            inference.act(action)
    return inference


# %%
exact = after_the_course("bayes-filter")
numbers = (100, 400, 1600, 6400)
errors = np.array(
    [[total_variation(after_the_course("particle", n_particles=n, seed=s), exact) for s in range(30)] for n in numbers]
)
means, margins = errors.mean(axis=1), 1.96 * errors.std(axis=1, ddof=1) / np.sqrt(errors.shape[1])
for n, mean, margin in zip(numbers, means, margins, strict=True):
    print(f"{n:>5} particles: error {mean:.4f} ± {margin:.4f}")

# %%
with plot_style():
    figure = figure_class()(figsize=(6.0, 3.2), layout="constrained")
    axes = figure.subplots()
    axes.errorbar(numbers, means, yerr=margins, fmt="o", color=PALETTE[0])
    axes.plot(numbers, means[0] * np.sqrt(numbers[0] / np.array(numbers)), "--", color=GREY, linewidth=1)
    axes.set(xscale="log", yscale="log", xlabel="particles", ylabel="total variation to exact")
    axes.set_title("The particle filter's error")
figure

# %% [markdown]
# ## Reports
#
# Engines that approximate say how they fared. Loopy belief propagation tells whether its messages converged, Gibbs
# sampling its split R-hat, mean field its free energy. A report can be content and the answer wrong: converged messages
# are a fixed point, not the posterior.

# %%
for engine in ("loopy-bp", "gibbs", "mean-field"):
    inference = after_the_course(engine)
    error = total_variation(inference, exact)
    print(f"{engine:<11} error {error:.4f}  {inference.report}")

# %% [markdown]
# `atg-fg engines compare --trials 50` makes this comparison at any size, `atg.compare_engines` on a memory and trials
# of your own, and `atg-fg engines check --engine NAME` tests posteriors against objects that were drawn from the model
# itself.
