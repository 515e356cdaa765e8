"""``pip install atg-fg`` alone: what needs no extra runs without the packages of any."""

import subprocess
import sys

TABLE = "trial,step,action,front,top\n1,0,turn,a,b\n1,1,,c,b\n2,0,turn,c,b\n2,1,,a,b\n"
PROGRAM = """
import sys

EXTRAS = {
    "PIL", "ap_gym", "cv2", "distributed", "jinja2", "jupytext", "lxml", "manifold3d", "matplotlib", "minari",
    "nbclient", "pybullet", "pybullet_data", "rerun", "rosbags", "stable_baselines3", "trimesh",
}

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in EXTRAS:
            raise ModuleNotFoundError(f"no {name} here", name=name)

sys.meta_path.insert(0, Blocked())
from atg_fg.cli import main

for line in sys.argv[1:]:
    sys.argv[1:] = line.split()
    try:
        main()
    except SystemExit as end:
        if end.code:
            sys.exit(f"{line}: {end.code}")
print("all ran")
"""
COMMANDS = (
    "recordings check table.csv --objects 2",
    "learn table.csv --objects 2 --memory memory.json",
    "recognise table.csv --memory memory.json",
    "memory show memory.json",
    "memory structure memory.json",
    "trial --seed 1",
    "table1 --tests 1 --trials 2 --actions 1 --jobs 1",
    "goal --trials 1 --jobs 1",
    "doctor",
    "look --help",
    "live --help",
)


def test_the_core_needs_no_extra(tmp_path):
    (tmp_path / "table.csv").write_text(TABLE)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *COMMANDS], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout.endswith("all ran\n")) == (0, True), done.stdout[-2000:] + done.stderr[-2000:]
