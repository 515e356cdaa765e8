"""Plots, pictures, camera frames and the Rerun viewer."""
