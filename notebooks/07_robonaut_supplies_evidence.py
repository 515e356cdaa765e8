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
# # A robot supplies the evidence
#
# Recognition needs two things from the world: actions that turn the object over, and looks that say what it shows. In
# this notebook a simulated robot does both. It turns a cube over by friction, in contact physics, and sees it with the
# camera in its head. Neither always comes out right, and how often they fail is what the model has to assume.
#
# The notebook shows the robot at work, counts failures in a small run, makes the model's noise of these counts, and
# lets the robot recognise a cube. Every random number comes from seed 0.

# %%
import numpy as np

import atg_fg as atg
from atg_fg.core.statistics import wilson_interval
from atg_fg.display.figures import GREY, INK, PALETTE, figure_class, plot_style

cubes = atg.make_arcubes(4, seed=0)
world = atg.make_world("robonaut", cubes=cubes, condition="nominal", render_mode="rgb_array")

# %%
# After the world, which imports the simulator without its banner.
from sim.manipulation.waypoints import GRIP_FORCE
from sim.noise_calibration import Counts, calibrate
from sim.reliability import run_actions, summarise
from sim.vision.camera import Camera
from sim.vision.tag_detection import draw_detections
from sim.worlds.domain_randomization import condition_named
from sim.worlds.film import observed

assumptions = atg.arcube_assumptions()
robot = world.unwrapped

# %% [markdown]
# ## The scene
#
# The robot is like NASA's Robonaut 2: two arms of seven joints each, and fists with a rubber pad on the knuckles. The
# arms' lengths and the limits of their angles and torques are Robonaut's; the shell is simplified. The cube, 28 cm
# wide, stands on a table.
#
# Left: what an observer sees. Right: what the robot sees, a frame of the camera in its head. Detected tags are
# outlined; from their poses the robot decides which is in front and which on top.


# %%
def gallery(pictures: dict[str, np.ndarray], columns: int, size: tuple[float, float]):
    """Return a figure of pictures with titles."""
    with plot_style():
        figure = figure_class()(figsize=size, layout="constrained")
        grid = figure.subplots(-(-len(pictures) // columns), columns, squeeze=False)
        for axes, (title, picture) in zip(grid.flat, pictures.items(), strict=True):
            axes.imshow(picture)
            axes.set_title(title, fontsize=10, pad=4)
            axes.set_axis_off()
    return figure


world.reset(seed=0, options={"object": 0, "orientation": 0})
head = draw_detections(robot.frame, robot.markers)
gallery({"an observer": world.render(), "the camera in the head": head}, columns=2, size=(7.4, 3.0))

# %% [markdown]
# ## One action: a flip
#
# A flip brings the top to the front. Its plan has these phases: *approach* the cube from both sides, *grasp* it, *lift*
# it, *turn* it by a quarter about the line between the hands, *put down*, *release*. Each picture is taken as its phase
# ends, but the fifth when the cube has turned by 45°.
#
# Nothing ties the cube to the hands. They press on it, and friction holds it or does not. Where to take hold comes from
# the camera's estimate of the cube's pose only; the simulator's truth is used for scoring only.

# %%
observer = Camera((1.42, 0.95, 0.85), (0.20, 0.05, 0.42), 44.0, (280, 265))
pictures: dict[str, np.ndarray] = {}
phases = ["before"]


def at_end_of_phase(next_phase: str) -> None:
    """Take a picture as the phase before the next one ends."""
    pictures[phases[-1]] = observed(robot.scene, observer)
    phases.append(next_phase)


def at_half_turn() -> None:
    """Take a picture when the face that was on top is turned by 45 degrees."""
    if phases[-1] == "turn" and "turn, half-way" not in pictures:
        _, rotation = robot.scene.cube.pose()
        if rotation[2, 2] < np.cos(np.pi / 4):
            pictures["turn, half-way"] = observed(robot.scene, observer)


# %%
robot.manipulator.on_phase, robot.scene.on_step = at_end_of_phase, at_half_turn
_, _, _, _, outcome = world.step(np.int64(assumptions.action_index("flip")))
gallery(pictures, columns=4, size=(10, 5.3))

# %%
print(f"each hand is told to press with {GRIP_FORCE:.0f} N")
print(f"the flip came out right: {outcome['right']}, in {outcome['simulated_seconds']:.1f} s of simulated time")
print(f"off by {outcome['angle_error']:.2f}° and {1000 * outcome['position_error']:.0f} mm from where it should stand")

# %% [markdown]
# ## The limits of the joints
#
# How near did this flip bring the joints to their limits? The bars give the greatest speed and the greatest torque of
# each joint as shares of its limits, since the trial began. A torque that would be greater is cut at its limit; a speed
# is kept by planning slower motions. The limits of speed are set to what an arm of this size has, since Robonaut's
# description has only token values there.
#
# The weight of the arms is compensated: at every way-point, inverse dynamics gives the torques that hold the arms
# still, and the controller adds them to those of its springs and dampers. The dots give these torques in the posture
# beside the cube.

# %%
JOINTS = "shoulder roll", "shoulder pitch", "upper-arm roll", "elbow", "forearm roll", "wrist pitch", "wrist yaw"
exertion, body = robot.controller.exertion, robot.scene.robot
gravity = np.abs(body.gravity_torques(body.model.home)) / body.effort
rows = np.arange(len(JOINTS))

# %%
with plot_style():
    figure = figure_class()(figsize=(8.4, 3.6), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, shares, title in zip(panels, (exertion.velocity, exertion.effort), ("Speed", "Torque"), strict=True):
        for arm, side in enumerate(("left arm", "right arm")):
            axes.barh(rows + 0.38 * arm - 0.19, 100 * shares[arm], 0.36, color=PALETTE[arm], label=side)
        axes.axvline(100, color=INK, linewidth=1, linestyle=":")
        axes.set(title=title, xlabel="share of the limit (%)", xlim=(0, 104))
        axes.grid(visible=True, axis="x")
        axes.grid(visible=False, axis="y")
    panels[1].plot(100 * gravity[0], rows - 0.19, "o", color=INK, markersize=4, label="against gravity alone")
    panels[1].plot(100 * gravity[1], rows + 0.19, "o", color=INK, markersize=4)
    panels[1].legend(loc="lower right", bbox_to_anchor=(0.95, 0.0), fontsize=8)
    panels[0].set_yticks(rows, JOINTS)
    panels[0].invert_yaxis()
figure

# %%
print(f"greatest share of a speed limit: {exertion.velocity.max():.0%}")
print(f"greatest share of a torque limit: {exertion.effort.max():.0%}; gravity alone: {gravity.max():.0%}")
print(f"steps in which a torque was cut: {exertion.saturated_steps} of {exertion.steps}")

# %% [markdown]
# No torque was cut. The arms move as mirror images, so their bars are alike. The greatest torque is that of the
# shoulder's pitch joint; in the posture beside the cube, gravity alone takes more than half of it.

# %% [markdown]
# ## Two conditions
#
# In the condition `nominal` the pads are in good order, the floor is steady and the camera is good. In `worn` the pads
# are polished, the cube's mass is unknown, the floor leans and the camera is poor; friction, mass and lean are drawn
# anew for each trial. The front of the same cube, as the robot sees it under both:

# %%
worn_world = atg.make_world("robonaut", cubes=cubes, condition="worn")
worn_world.reset(seed=0, options={"object": 0, "orientation": 0})
world.reset(seed=0, options={"object": 0, "orientation": 0})
frames = {}
for name, seen_by in {"nominal": robot, "worn": worn_world.unwrapped}.items():
    drawn = seen_by.circumstances
    print(f"{name:8} friction of the pads {drawn.pad_friction:.2f}, mass of the cube {drawn.cube_mass:.2f} kg")
    frames[name] = seen_by.frame[150:225, 85:245]
worn_world.close()
gallery(frames, columns=2, size=(6.4, 1.75))

# %% [markdown]
# ## What the camera reads
#
# A small run in `worn`: 14 random actions, a new cube after the first ten. Each look has two slots, front and top. The
# heat map counts, for each symbol that was shown, the symbols that were detected; what is off the diagonal is wrong,
# and the last column counts slots in which nothing was detected.

# %%
runs = run_actions("worn", 14, seed=0, jobs=1)
looks = [look for run in runs for look in run.looks]
n_tags = assumptions.alphabet.n_symbols
confusion = np.zeros((n_tags, n_tags + 1), dtype=int)
for look in looks:
    for shown, detected in zip(look.shown, look.detected, strict=True):
        confusion[shown, detected] += 1  # a slot in which nothing was detected is -1: the last column

# %%
with plot_style():
    figure = figure_class()(figsize=(5.7, 4.7), layout="constrained")
    axes = figure.subplots()
    image = axes.imshow(confusion, cmap="Blues", vmin=0)
    for shown, detected in np.argwhere(confusion):
        count = confusion[shown, detected]
        color = "white" if count > confusion.max() / 2 else INK
        axes.text(detected, shown, count, ha="center", va="center", color=color)
    axes.axvline(n_tags - 0.5, color=GREY, linewidth=1)
    axes.set_xticks(range(n_tags + 1), [*map(str, range(n_tags)), "\nmissing"])
    axes.set_yticks(range(n_tags))
    axes.set(xlabel="detected", ylabel="shown", title=f"Symbols in the slots of {len(looks)} looks, worn")
    axes.grid(visible=False)
    figure.colorbar(image, ax=axes, label="slots", shrink=0.8)
figure


# %%
def rate(count: int, total: int) -> str:
    """Return a rate with its 95 % Wilson interval."""
    low, high = wilson_interval(count, total)
    return f"{count} of {total}, {count / total:.0%} [{low:.0%}, {high:.0%}]"


print("symbols shown:", ", ".join(map(str, np.flatnonzero(confusion.sum(axis=1)))))
print("slots detected rightly:", rate(int(np.trace(confusion)), int(confusion.sum())))
print("looks with a wrong symbol:", rate(sum(look.n_wrong > 0 for look in looks), len(looks)))

# %% [markdown]
# No symbol was read wrongly, in spite of the noise; in one slot nothing was detected. That is no proof that the camera
# never errs: with so few looks the interval still allows for a wrong look now and then. It takes looks to be
# independent, too, which those at one cube are not quite.

# %% [markdown]
# ## What the hands do
#
# An action is *right* if it leaves the cube within 20° and 6 cm of where it should stand. The same run, by action, with
# 95 % Wilson intervals:

# %%
summary = summarise(runs)
rates = {**summary["by_action"], "all": summary["success"]}
with plot_style():
    figure = figure_class()(figsize=(6.4, 2.6), layout="constrained")
    axes = figure.subplots()
    for row, (action, measured) in enumerate(rates.items()):
        color = INK if action == "all" else PALETTE[0]
        axes.plot(100 * np.array(measured["interval95"]), [row, row], color=color, linewidth=3, alpha=0.4)
        axes.plot(100 * measured["rate"], row, "o", color=color)
        text = f"{measured['count']} of {measured['of']}"
        axes.text(1.03, row, text, color=color, va="center", transform=axes.get_yaxis_transform())
    axes.set_yticks(range(len(rates)), rates)
    axes.set(xlabel="right (%)", xlim=(-2, 102), ylim=(len(rates) - 0.5, -0.5))
    axes.set_title("Actions that came out right, worn")
    axes.grid(visible=True, axis="x")
    axes.grid(visible=False, axis="y")
figure

# %%
for failure, count in summary["failures"].items():
    print(f"{failure.replace('_', ' ')}: {count}")

# %% [markdown]
# Every flip failed, and none of the other actions did. A flip has to lift the cube clear of the table, while left and
# right turn it hardly lifted. Each time it failed, the cube stayed as it was.
#
# Lifting asks friction to bear the cube's weight: twice the force of a hand times the friction between pad and cube.
# How often can it, in what `worn` may draw?

# %%
rng = np.random.default_rng(0)
draws = [condition_named("worn").draw(rng) for _ in range(10_000)]
holds = [2 * GRIP_FORCE * drawn.pad_friction * drawn.cube_friction >= 9.81 * drawn.cube_mass for drawn in draws]
print("draws in which friction can bear the weight:", rate(sum(holds), len(holds)))

# %% [markdown]
# So failing flips are not the rule in `worn`; the trials of this run seem to be among the unlucky draws. The intervals
# do not show this. They take actions to be independent, but friction and mass were drawn once for each trial, and there
# were two trials.

# %% [markdown]
# ## From counts to a preset
#
# The model has two kinds of noise. $\alpha$ is the weight, in counts, of *anything may follow* against the edges that
# were observed: an edge seen once gets the share $1 / (1 + \alpha)$, and the rest is spread over all aspects alike.
# $\delta$ is the probability that a look shows a pattern drawn from all 132 alike, whatever is there. `docs/model.md`
# has both in its equations.
#
# `calibrate` sets them so that the model fails as often as the robot did: $\alpha / (1 + \alpha)$ is the rate of failed
# actions, and $\delta\,(1 - 1/132)$ that of wrong looks. Rates are posterior means under Jeffreys' prior, so what never
# failed in the run is not held to be impossible.

# %%
failures, detection = summary["failures"], summary["detection"]
counts = Counts(
    actions=summary["success"]["of"] - failures["lost"],
    failed=failures["stayed"] + failures["another_orientation"],
    looks=detection["both"]["of"],
    wrong=detection["wrong_ids"]["count"],
    missing=detection["one"]["count"] + 2 * detection["none"]["count"],
)
parameters, missing_rate = calibrate(counts)
print(counts)
print(f"α = {parameters.transition_concentration:.3f}, δ = {parameters.observation_noise:.3f}")
print(f"rate at which a slot's tag is missing: {missing_rate:.3f}")

# %% [markdown]
# How wide is the interval? The ends of the Wilson interval of each rate give those of $\alpha$ and of $\delta$.

# %%
measured = {
    "α": (counts.failed, counts.actions, parameters.transition_concentration, lambda rate: rate / (1 - rate)),
    "δ": (counts.wrong, counts.looks, parameters.observation_noise, lambda rate: rate * 132 / 131),
}
with plot_style():
    figure = figure_class()(figsize=(6.4, 1.9), layout="constrained")
    axes = figure.subplots()
    for row, (name, (count, total, estimate, from_rate)) in enumerate(measured.items()):
        ends = [from_rate(end) for end in wilson_interval(count, total)]
        print(f"{name} = {estimate:.3f}, interval {ends[0]:.3f} to {ends[1]:.3f}")
        axes.plot(ends, [row, row], color=PALETTE[0], linewidth=3, alpha=0.4)
        axes.plot(estimate, row, "o", color=PALETTE[0])
    axes.set_yticks(range(len(measured)), measured)
    axes.set(ylim=(1.6, -0.6), xlabel="value", title=f"Noise estimated from {counts.actions} actions, worn")
    axes.grid(visible=True, axis="x")
    axes.grid(visible=False, axis="y")
figure

# %% [markdown]
# So few actions leave much open: the upper end of $\alpha$ is more than seven times the lower, and of $\delta$ the run
# gives hardly more than an upper end. These commands measure 1,000 actions in each condition and write a preset; the
# figures are in `docs/simulation.md`:
#
# ```sh
# atg-fg sim reliability --condition nominal --actions 1000 --json nominal.json
# atg-fg sim reliability --condition worn --actions 1000 --json worn.json
# atg-fg sim calibrate worn.json --output worn_preset.json
# ```

# %% [markdown]
# ## The robot recognises a cube
#
# First a small memory: each of 4 cubes is turned over by 12 random actions in the ideal world, and is known to be new.

# %%
memory = atg.RobotMemory(assumptions)
ideal = atg.make_world("ideal", cubes=cubes)
rng = np.random.default_rng(0)
for cube in range(len(cubes)):
    inference = atg.begin_trial("bayes-filter", memory, atg.preset("default"))
    learned = atg.run_trial(ideal, inference, atg.make_policy("random"), 12, rng, reset_options={"object": cube})
    memory.learn(learned.patterns, learned.actions, matched=None)
list(memory)

# %% [markdown]
# Now cube 2 is put before the robot, in the condition `nominal`. Four times the robot looks and takes the action of
# least expected entropy; then it looks once more. The model assumes the noise that was estimated above. It was counted
# in `worn`, so the model may expect more failures than there are here.

# %%
PRESENTED = 2
inference = atg.begin_trial("gtsam", memory, parameters)
rng = np.random.default_rng(0)
record = atg.run_trial(world, inference, atg.make_policy("entropy"), 4, rng, reset_options={"object": PRESENTED})
world.close()
for number, step in enumerate(record.steps):
    look = "right" if step.detection == step.truth["pattern"] else f"wrong, shown was {step.truth['pattern']}"
    print(f"look {number}: front and top {step.detection}, {look}")
    if step.action is not None:
        action = "right" if record.steps[number + 1].truth["right"] else "wrong"
        print(f"  then {assumptions.actions[step.action]}, {action}")

# %%
atg.plot_belief([step.belief for step in record.steps], record.names)

# %%
truth = memory.names[PRESENTED]
best = record.belief.objects.max()
print(f"verdict: {record.verdict}, {record.matched}; truth: {truth}")
print(f"probability that it is anything else: {1 - best:.0e}")
assert record.matched == truth

# %% [markdown]
# At first the cube is most probably one that the robot has never met: there are 100 cubes, of which it remembers 4. One
# flip shows a pattern that the ATG of the right cube foretold, which no other ATG of the memory did, and the belief
# moves to it. It is one trial, and easy: no action failed and no look was wrong. How often recognition is right takes
# many trials.
