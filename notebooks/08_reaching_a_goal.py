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
# # Reaching a goal
#
# The paper's Figure 2: three cubes stand before the robot. It turns each until it knows which one it is, and then takes
# the shortest path in the matched ATG from the aspect it sees to the one that it wants to see. This notebook does that
# step by step: goals, paths, acting on a belief, several cubes at once, and goals that no path leads to.

# %%
from dataclasses import replace

import numpy as np

import atg_fg as atg
from atg_fg.display.figures import PALETTE, figure_class, plot_style
from atg_fg.experiments.exploration import learned_memory
from atg_fg.experiments.goal_scores import summarise
from atg_fg.experiments.goals import COMPLETE, GoalPlan, run_many
from atg_fg.inference.all_different import different_identities
from atg_fg.inference.known_transitions import transitions_of_graph
from atg_fg.policies.shortest_paths import nearest_aspect, reachable_aspects, shortest_path

assumptions = atg.arcube_assumptions()
alphabet = assumptions.alphabet
cubes = atg.make_arcubes(20, seed=0)
memory = learned_memory(assumptions, cubes, atg.make_policy("explore"), 20, np.random.default_rng(0))
graph = memory["object-000"]
graph

# %% [markdown]
# The memory holds 20 cubes, each turned over in one trial of 20 actions by a policy that tries what is untried.
#
# ## Paths
#
# A goal is a pattern or a part of one. Not every aspect that the robot has seen can be reached from every other: it
# knows which way an action led, not the way back.

# %%
paths = transitions_of_graph(graph)
reach = [len(reachable_aspects(paths, aspect)) for aspect in range(graph.n_known)]
print(f"{graph.n_known} of 24 aspects known; from each of them {min(reach)} to {max(reach)} can be reached")

source = int(np.argmax(reach))
lengths = {
    target: len(path.actions)
    for target in range(graph.n_known)
    if (path := shortest_path(paths, source, atg.Goal(alphabet, graph.aspects[target]))) is not None
}
goal = atg.Goal(alphabet, graph.aspects[max(lengths, key=lengths.get)])
way = shortest_path(paths, source, goal)
print(f"from {graph.aspects[source]} to {goal}: {[assumptions.actions[action] for action in way.actions]}")

# %%
steps = list(zip(way.aspects, way.actions, way.aspects[1:], strict=False))
atg.plot_atg(graph, highlight=source, path=steps)

# %% [markdown]
# A part of a pattern is easier to reach, and a symbol that the cube does not have cannot be reached at all. Then the
# nearest aspect is the one with most of what was wanted.

# %%
on_top = atg.Goal.of_slots(alphabet, {"top": goal.symbols[1]})
part = shortest_path(paths, source, on_top)
print(f"{on_top}: {len(part.actions)} actions; the whole of {goal}: {len(way.actions)}")

absent = next(tag for tag in range(12) if tag not in cubes[0])
impossible = atg.Goal(alphabet, (absent, goal.symbols[1]))
nearest = graph.aspects[nearest_aspect(paths, source, impossible).aspects[-1]]
print(f"{impossible}: {shortest_path(paths, source, impossible)}; nearest {nearest}")

# %% [markdown]
# ## What a path costs
#
# Edges cost what their action is expected to take: an action that worked in one of four attempts costs four. So a
# reliable way wins over a short one. In this little ATG a flip leads to the goal one time in four; two turns always do.

# %%
risky = atg.AspectTransitionGraph("risky", assumptions)
for pattern in [(0, 1), (2, 1), (3, 1)]:
    risky.add_aspect(pattern)
flip, left, right = range(3)
for here, action, there, count in [(0, flip, 2, 1), (0, flip, 0, 3), (0, left, 1, 4), (1, left, 2, 4)]:
    risky.add_transition(here, action, there, count)
sure_way = shortest_path(transitions_of_graph(risky), 0, atg.Goal(alphabet, (3, 1)))
print([assumptions.actions[action] for action in sure_way.actions], f"cost {sure_way.cost}")
atg.plot_atg(risky, highlight=0, path=[(0, left, 1), (1, left, 2)])

# %% [markdown]
# ## Acting on a belief
#
# `GoalPolicy` is a policy like the others. After each look it asks three things. Is the goal shown, with the confidence
# asked for? Is the identity settled? Which action has the least expected cost, over all that is believed? Nothing else
# is kept, so a slip is planned anew from where the cube really is.


# %%
def served(policy, cube, seed, **noise):
    """A trial with one cube of a noisy or ideal world."""
    inference = atg.begin_trial("gtsam", memory, atg.preset("default"))
    rng = np.random.default_rng(seed)
    world = atg.make_world("ideal", cubes=cubes, **noise)
    return atg.run_trial(world, inference, policy, 40, rng, reset_options={"object": cube})


record = served(atg.GoalPolicy(goal), cube=0, seed=1)
for number, step in enumerate(record.steps):
    action = "" if step.action is None else assumptions.actions[step.action]
    entropy = step.belief.entropy_of_verdict
    print(f"look {number}: {step.detection}, entropy {entropy:.3f}; {step.purpose} {action}")

# %% [markdown]
# ## Several cubes at once
#
# The cubes on the table are different ones. In one factor graph there is an `O` and a chain of aspects for each of
# them, and a factor that says that no two are the same object.

# %%
trials = [atg.begin_trial("gtsam", memory, atg.preset("default")) for _ in range(2)]
for trial, name in zip(trials, ("object-000", "object-001"), strict=True):
    trial.observe(atg.Evidence.of_detection(alphabet, memory[name].aspects[0]))
joint = atg.JointRecognitionGraph([trial.chain() for trial in trials], memory.n_unseen)
joint

# %% [markdown]
# Suppose that the robot has turned one cube over until it is sure, and has only glanced at another whose one look fits
# several objects, the first among them. What it knows of the first then rules that object out for the other. The same
# posteriors come without a factor over all identities, by a recursion over sets of cubes that also works with many.

# %%
sure, glance = (atg.begin_trial("gtsam", memory, atg.preset("default")) for _ in range(2))
for time, aspect in enumerate(way.aspects):
    sure.observe(atg.Evidence.of_detection(alphabet, graph.aspects[aspect]))
    if time < len(way.actions):
        sure.act(way.actions[time])
glance.observe(atg.Evidence.of_detection(alphabet, (graph.aspects[source][0], None)))
alone = [sure.identity(), glance.identity()]
together = different_identities(alone)
from_graph = atg.JointRecognitionGraph([sure.chain(), glance.chain()], memory.n_unseen).identities()
assert max(abs(a.probabilities - b.probabilities).max() for a, b in zip(together, from_graph, strict=True)) < 1e-12

# %%
with plot_style():
    figure = figure_class()(figsize=(6.4, 2.0), layout="constrained")
    axes = figure.subplots()
    for place, beliefs in enumerate((alone, together)):
        for number, belief in enumerate(beliefs):
            axes.barh(place + 0.36 * number - 0.18, belief.objects[0], 0.34, color=PALETTE[number])
            axes.text(belief.objects[0] + 0.01, place + 0.36 * number - 0.18, f"{belief.objects[0]:.3f}", va="center")
    axes.set(yticks=range(2), yticklabels=["each alone", "two different ones"], xlim=(0, 1.12))
    axes.set(xlabel="p(it is object-000): the turned cube (blue), the glanced at one (orange)")
    axes.set_title("What is known of one cube rules it out for the other")
    axes.invert_yaxis()
figure

# %% [markdown]
# ## The experiment
#
# Three of 20 cubes, random goals, in the ideal world: 20 runs from seed 0. With a complete memory every goal is reached
# by as few actions as can be. With one trial of 20 actions a cube about half of the goals have a known path; those are
# reached, and the others are declared out of reach.

# %%
base = GoalPlan(engine="bayes-filter", parameters=atg.preset("default"))
plans = {
    "complete memory": replace(base, learning_actions=COMPLETE),
    "20 actions, declare": base,
    "20 actions, explore": replace(base, unreachable="explore"),
    "20 actions, value iteration": replace(base, planner="value-iteration"),
}
summaries = {name: summarise(list(run_many(plan, seed=0, n_runs=20))) for name, plan in plans.items()}
for name, summary in summaries.items():
    shares = [summary[rate] for rate in ("reached", "reached_of_reachable", "declared_of_unreachable")]
    print(f"{name:>28}:", ", ".join(f"{share['count']}/{share['of']}" for share in shares))
assert summaries["complete memory"]["optimal"]["count"] == 60
assert all(summary["wrong_success"]["count"] == 0 for summary in summaries.values())

# %% [markdown]
# *(goals reached; reached of those with a known path; declared of the others that were not met.)* Exploring tries what
# was never tried, nearest first. Value iteration is the exact reference, QMDP on the same model: it counts on what an
# untried action might show, so it never gives up, and pays with more actions.

# %%
with plot_style():
    figure = figure_class()(figsize=(6.4, 2.8), layout="constrained")
    axes = figure.subplots()
    for place, summary in enumerate(summaries.values()):
        rate = summary["reached"]
        low, high = rate["interval95"]
        axes.barh(place, rate["rate"], color=PALETTE[place], height=0.6)
        axes.plot([low, high], [place, place], color="black", linewidth=1.2)
        extra = summary["goal_actions"] - summary["optimum"]
        axes.text(1.02, place, f"{extra:+.2f} actions", va="center", fontsize=9)
    axes.set(yticks=range(len(summaries)), yticklabels=list(summaries), xlim=(0, 1.25), xlabel="share of goals reached")
    axes.set_title("Goals reached, and actions beyond the fewest")
    axes.invert_yaxis()
figure

# %% [markdown]
# ## On the robot
#
# The same, with contact physics and the head's camera: the robot slides on a rail from cube to cube.
#
# ```sh
# atg-fg goal --world robonaut --trials 20 --engine bayes-filter --video goal.gif
# ```
#
# ![The robot before three cubes](../docs/images/robonaut_table.png)
