"""All figures of trials, ATGs and experiments, a call each.

Every figure is a ``matplotlib.figure.Figure`` of its own: nothing here touches ``pyplot`` or leaves a setting behind.
matplotlib is imported by the first figure that is drawn, not with the package.
"""

from __future__ import annotations

from atg_fg.display.success_plots import plot_ablation, plot_success
from atg_fg.display.trial_plots import plot_atg, plot_belief, plot_entropy

__all__ = ["plot_ablation", "plot_atg", "plot_belief", "plot_entropy", "plot_success"]
