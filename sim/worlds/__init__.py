"""Worlds in simulation: a rendered cube, and a robot that turns cubes and looks at them."""

from sim.simulator import import_quietly, require_simulator

# Here, because worker processes come in by this door as well.
require_simulator()
import_quietly("pybullet")
