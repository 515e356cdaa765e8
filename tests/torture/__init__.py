"""What files must survive: kill -9 and power cuts at any moment, a full disk, a read-only folder, damage of any kind.

``python -m tests.torture`` runs all of it (``make torture``); tests/test_torture.py runs a little of each.
"""
