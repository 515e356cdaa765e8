"""What the robot sees: cameras, image noise, tags, and the pose of the cube."""

from sim.simulator import import_quietly, require_simulator

# Here, because worker processes come in by this door as well.
require_simulator()
import_quietly("pybullet")
