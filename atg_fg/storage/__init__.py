"""What is on disk: memories, logs of trials, presets, and the formats of other tools."""
