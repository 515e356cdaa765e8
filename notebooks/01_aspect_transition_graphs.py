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
# # Aspect Transition Graphs
#
# An *aspect* is what a robot measures of an object in one pose relative to its sensors. An *Aspect Transition Graph*
# (ATG) joins the aspects of one object by the robot's own actions: the edge $x \xrightarrow{a} y$ says that aspect $y$
# was observed after action $a$ in aspect $x$, and how often. So an ATG is a model of an object in terms of what the
# robot can do to it and see of it, and it is learned by acting.
#
# This notebook shows the objects of the paper's experiments, learns the ATG of one of them, draws it as in the paper's
# Figure 1, and shows how ATGs grow with exploration. Every random number comes from seeds 0, 1, 2, ….

# %%
import tempfile
from pathlib import Path

import numpy as np

import atg_fg as atg
from atg_fg.display.figures import GREY, PALETTE, figure_class, plot_style

# %% [markdown]
# ## An ARcube
#
# An *ARcube* is a cube of 28 cm with six different tags out of twelve. The camera sees two faces at a time. Which tag
# is in front and which on top is read from the tags' poses in the image; this pair is the *pattern* that the aspect
# shows. Here is the first of the cubes drawn with seed 0, upright, and after each of the three actions: *flip* turns
# the top face to the front, *left* and *right* turn a side face to the front.

# %%
cubes = atg.make_arcubes(100, seed=0)
assumptions = atg.arcube_assumptions(n_objects=100)
camera_world = atg.make_world("rendered", cubes=cubes).unwrapped

# After the world, which imports the simulator without its banner.
from sim.bodies.cube import tag_image
from sim.vision.tag_detection import draw_detections


def seen_after(action: str | None) -> np.ndarray:
    """Return the camera frame of cube 0, upright and then turned by one action, with its detections."""
    camera_world.reset(seed=0, options={"object": 0, "orientation": 0})
    if action is not None:
        camera_world.step(np.int64(assumptions.action_index(action)))
    return draw_detections(camera_world.frame, camera_world.markers)


# %%
with plot_style():
    figure = figure_class()(figsize=(10, 2.3), layout="constrained")
    for axes, action in zip(figure.subplots(1, 4), (None, *assumptions.actions), strict=True):
        axes.imshow(seen_after(action))
        axes.set_title(action or "upright")
        axes.set_axis_off()
camera_world.close()
figure

# %% [markdown]
# ## What is taken for granted
#
# Before it meets any object, the robot knows that there are $|\mathcal{O}| = 100$ objects with $|G| = 24$ aspects each
# (six faces can be in front, and four of the others on top), three actions, and $12 \cdot 11 = 132$ patterns.

# %%
print(f"|O| = {assumptions.n_objects}, |G| = {assumptions.n_aspects}, |Z| = {len(assumptions.alphabet)} patterns")
print("actions:", ", ".join(assumptions.actions))

# %% [markdown]
# ## A memory, learned by turning cubes over
#
# A trial is a sequence: look, act, look, act, …, look. What it shows goes into the *robot memory*, a new ATG if the
# object was judged novel. Here the world is ideal (no action fails, every look is right), so that a pattern identifies
# an aspect of one object; the actions are random. One trial of 6 actions with cube 0, seed 0:

# %%
world = atg.make_world("ideal", cubes=cubes)


def explore(world, memory: atg.RobotMemory, cube: int, n_actions: int, seed: int) -> atg.TrialRecord:
    """Turn one cube over at random."""
    inference = atg.begin_trial("bayes-filter", memory, atg.preset("default"))
    rng = np.random.default_rng(seed)
    return atg.run_trial(world, inference, atg.make_policy("random"), n_actions, rng, reset_options={"object": cube})


memory = atg.RobotMemory(assumptions)
record = explore(world, memory, cube=0, n_actions=6, seed=0)
record

# %% [markdown]
# What was learned from it: a row for each known aspect, and where each action led from there.

# %%
name = atg.learn_from(record, memory)
graph = memory[name]
graph

# %%
memory

# %% [markdown]
# ## The ATG, drawn as in Figure 1 of the paper
#
# Each cube is a known aspect with its two tags. A solid edge is a transition that was observed. All aspects that were
# not are one *collection node*, of size $|G| - n$ when $n$ aspects are known. A dotted edge is an action not yet tried
# in an aspect; it is drawn to the collection node, but may lead to an aspect that is known already, too.

# %%
atg.plot_atg(graph, symbol_images={symbol: tag_image(symbol) for symbol in range(12)})

# %% [markdown]
# ## The same as a networkx graph
#
# Every algorithm of networkx can be used on an ATG. An edge says whether it was observed, and how often.

# %%
view = graph.to_networkx()
print(f"{view}, of them {sum(not data['observed'] for *_, data in view.edges(data=True))} unknown transitions")
for source, target, data in view.edges(data=True):
    if data["observed"]:
        print(f"{view.nodes[source]['pattern']} --{data['action']}--> {view.nodes[target]['pattern']}: {data['count']}")

# %% [markdown]
# ## An ATG grows with exploration
#
# How many actions does it take to know a cube? Known aspects and known (aspect, action) pairs, by the number of random
# actions in one long trial; mean over 40 runs (seeds 0 to 39, each with a cube of its own), with 95 % intervals of the
# mean.

# %%
N_RUNS, N_ACTIONS = 40, 120


def growth(record: atg.TrialRecord) -> list[tuple[int, int]]:
    """Return the known aspects and the known (aspect, action) pairs after each look."""
    grown = atg.AspectTransitionGraph("growing", assumptions)
    counts = []
    for time in range(len(record.patterns)):
        first = max(time - 1, 0)
        grown.learn(record.patterns[first : time + 1], record.actions[first:time])
        counts.append((grown.n_known, len(grown.counts)))
    return counts


runs = np.array([growth(explore(world, atg.RobotMemory(assumptions), run, N_ACTIONS, run)) for run in range(N_RUNS)])
runs.shape

# %%
mean = runs.mean(axis=0)
margin = 1.96 * runs.std(axis=0, ddof=1) / np.sqrt(N_RUNS)
curves = (("known aspects", 24, PALETTE[0]), ("known (aspect, action) pairs", 72, PALETTE[1]))
with plot_style():
    figure = figure_class()(figsize=(7.2, 3.9), layout="constrained")
    axes = figure.subplots()
    for column, (label, total, color) in enumerate(curves):
        y, dy = mean[:, column], margin[:, column]
        axes.axhline(total, color=GREY, linewidth=1, linestyle=":")
        axes.fill_between(range(N_ACTIONS + 1), y - dy, y + dy, color=color, alpha=0.2, linewidth=0)
        axes.plot(y, color=color)
        axes.text(75, y[75] - 3, label, color=color, va="top", fontweight="bold")
        axes.text(0, total + 0.8, f"all {total}", color=GREY, fontsize=8)
    axes.set(xlabel="actions taken", ylabel="known", xlim=(0, N_ACTIONS), ylim=(0, 78))
    axes.set_title(f"What is known of a cube ({N_RUNS} cubes, mean and 95 % interval)")
figure

# %%
for actions in (10, 30, 120):
    aspects, pairs = mean[actions]
    half = margin[actions]
    print(f"{actions:3} actions: {aspects:.1f} ± {half[0]:.1f} of 24 aspects, {pairs:.1f} ± {half[1]:.1f} of 72 pairs")

# %% [markdown]
# Ten random actions, as many as a trial of Table 1 has, show a third of a cube's aspects and an eighth of its (aspect,
# action) pairs. So recognition has to work with incomplete ATGs, whose collection node carries much of the probability.

# %% [markdown]
# ## On disk
#
# A memory is saved as plain JSON that states its assumptions, and is checked when it is loaded.

# %%
with tempfile.TemporaryDirectory() as folder:
    atg.save_memory(memory, Path(folder) / "memory.json")
    assert atg.load_memory(Path(folder) / "memory.json") == memory
    text = (Path(folder) / "memory.json").read_text()
print("\n".join(text.splitlines()[:14]))
