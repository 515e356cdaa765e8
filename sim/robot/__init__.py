"""A Robonaut-like robot: two 7-joint arms that turn the cube by friction, and a head that looks at it."""

from sim import import_quietly, require_simulator

# Here, because worker processes come in by this door as well.
require_simulator()
import_quietly("pybullet")
