"""Loops that Numba compiles, and the arrays that they work on.

The rest of the library says in NumPy what they compute, and does without them where Numba is not installed: these say
the same, several times as quickly. Nothing here loads Numba before something is computed with it.
"""
