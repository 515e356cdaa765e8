"""Trials and tests: run, scored, compared, on many processors; recognition as a task for reinforcement learning.

Importing this package registers the task with gymnasium; its module is imported when one is made.
"""

import gymnasium

gymnasium.register(id="atg_fg/Recognition-v0", entry_point="atg_fg.experiments.recognition_env:make_recognition_env")
