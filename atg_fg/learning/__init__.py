"""What is learned across trials: the structure that objects share, duplicates, memories united."""
