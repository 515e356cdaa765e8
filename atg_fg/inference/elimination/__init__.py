"""Exact answers about any discrete factor graph, by bucket elimination."""
