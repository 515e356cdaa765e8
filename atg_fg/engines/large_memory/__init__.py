"""Memories of a hundred thousand ATGs and more: kept as arrays, and filtered where patterns match."""
