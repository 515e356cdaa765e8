"""How the robot turns the cube: waypoints, inverse kinematics, control, execution."""

from sim.simulator import import_quietly, require_simulator

# Here, because worker processes come in by this door as well.
require_simulator()
import_quietly("pybullet")
