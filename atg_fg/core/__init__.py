"""The paper's nouns as plain data: patterns, ATGs, memory, belief, goals, records of trials.

Nothing here infers, draws or touches a disk.
"""
