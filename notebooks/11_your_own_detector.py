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
# # Your own detector
#
# A recording of your own detector is a table: what was seen, what was done, look by look. Here a world stands in for
# detector and robot, with four boxes that have a label on each of six sides; put the path of your own CSV in place of
# `looks.csv`. What is said of the boxes is how many there are.

# %%
import tempfile
from pathlib import Path

import atg_fg as atg
from atg_fg.experiments.recorded_trials import recognise
from atg_fg.experiments.simulated_recording import simulated_recording
from atg_fg.learning.predictive_checks import summary_of_evidence
from atg_fg.learning.structured_memory import memory_for
from atg_fg.report.recognised import write_page
from atg_fg.storage.recordings import check_recording, read_recording, write_recording

folder = Path(tempfile.mkdtemp())
noise = {"wrong": 0.05, "missing": 0.05, "confidences": True}
write_recording(simulated_recording("detector", 4, 24, 8, seed=0, **noise), folder / "looks.csv")
write_recording(simulated_recording("detector", 4, 6, 8, seed=1, objects_seed=0, **noise), folder / "later.csv")
print("".join((folder / "looks.csv").open().readlines()[:6]))

# %% [markdown]
# ## Looked at
#
# Before anything is learned: what is in it, and what is odd.

# %%
recording, odd = check_recording(folder / "looks.csv")
print(
    f"{len(recording.trials)} trials; actions {recording.actions}; labels {recording.labels}; odd: {odd or 'nothing'}"
)

# %% [markdown]
# ## Learned
#
# Each trial is judged, and learned from, before the next. The column `object` is not looked at.

# %%
learned = atg.preset("learned")
memory = memory_for(learned, atg.RobotMemory(recording.assumptions(4)))
found = recognise(recording, memory, "learned-structure", learned, learn=True)
owners = memory.learner.owners
for name in memory.names:
    of = sorted({trial.object for trial, owner in zip(recording.trials, owners, strict=True) if owner == name})
    print(f"{name}: {owners.count(name)} trials, in truth of {', '.join(of)}")

# %% [markdown]
# ## How the detector errs
#
# The world was told to show one label in twenty wrong, and no action to fail. From 216 looks that is known roughly.

# %%
summary = summary_of_evidence(memory)
print(f"wrong labels: {summary['wrong']:.1%}, actions that fail: {summary['slip']:.1%}")

# %% [markdown]
# ## Views that look alike
#
# What the structure of most weight says of each object: the label in each of its states, where it is sure of one, and
# which labels several states show. A state that the structure has beside one that does the same is told as alike, too.

# %%
best = max(memory.evidence.believed(memory.names), key=lambda chain: chain.weight)
labels = recording.labels
for index, name in enumerate(memory.names):
    shown = [labels[int(best.tables[index, register].argmax())] for (register,) in best.registers.tolist()]
    sure = [float(best.tables[index, register].max()) > 0.5 for (register,) in best.registers.tolist()]
    kept = [label for label, is_sure in zip(shown, sure, strict=True) if is_sure]
    alike = sorted({label for label in kept if kept.count(label) > 1})
    print(f"{name}: {', '.join(kept)}; look alike: {', '.join(alike) or 'none'}")

# %% [markdown]
# ## The next trial
#
# Recognised, not learned from: the belief after every look.

# %%
later = read_recording(folder / "later.csv")
judged = recognise(later, memory, "learned-structure", learned)
judged[0].record

# %%
atg.plot_belief(judged[0].record)

# %%
for each in judged:
    print(f"trial {each.trial.name}: {each.record.verdict}, {each.record.matched}; in truth {each.trial.object}")

# %% [markdown]
# ## The report
#
# One HTML page that needs no network: `atg-fg recognise later.csv --memory robot.db --report page.html`.

# %%
write_page(judged, memory, None, folder / "page.html")
print(f"{(folder / 'page.html').stat().st_size > 10_000=}")

# %% [markdown]
# ## What a wrong assumption looks like
#
# The same trials, to a robot that is told there are two boxes: it finds more, and says so.

# %%
misled = memory_for(learned, atg.RobotMemory(recording.assumptions(2)))
recognise(recording, misled, "learned-structure", learned, learn=True)
for warning in summary_of_evidence(misled)["warnings"]:
    print(warning)
