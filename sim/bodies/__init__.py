"""Bodies of the simulation: cubes, the robot, its rail, and the URDF files that describe robots."""

from sim.simulator import import_quietly, require_simulator

# Here, because worker processes come in by this door as well.
require_simulator()
import_quietly("pybullet")
