"""Trials and tests: run, scored, compared, on many processors; recognition as a task for reinforcement learning."""
