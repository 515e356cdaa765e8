"""Measurements: ratios taken side by side in one run. ``benchmarks.cli`` is ``atg-fg bench``."""
