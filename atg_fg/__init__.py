"""Aspect Transition Graphs as discrete factor graphs."""

from atg_fg import worlds  # registers the worlds with gymnasium

__version__ = "0.1.0"
__all__ = ["worlds"]
