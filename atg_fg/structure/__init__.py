"""The structure that objects share: registers that actions permute, learned from all trials in memory."""
