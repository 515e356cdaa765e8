"""What is installed without extras, or by ``make demo``, runs without the packages that are left out."""

import subprocess
import sys

import pytest

TABLE = "trial,step,action,front,top\n1,0,turn,a,b\n1,1,,c,b\n2,0,turn,c,b\n2,1,,a,b\n"
EXTRAS = (
    "PIL", "ap_gym", "cv2", "distributed", "jinja2", "jupytext", "lxml", "manifold3d", "matplotlib", "minari",
    "nbclient", "pybullet", "pybullet_data", "rerun", "rosbags", "stable_baselines3", "trimesh",
)  # fmt: skip
PROGRAM = """
import sys

left_out, *lines = sys.argv[1:]
sys.modules.update(dict.fromkeys(left_out.split()))
from atg_fg.cli import main

for line in lines:
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


def check_that_all_run(left_out, commands, folder):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, " ".join(left_out), *commands],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout.endswith("all ran\n")) == (0, True), done.stdout[-2000:] + done.stderr[-2000:]


@pytest.mark.slow
def test_the_core_needs_no_extra(tmp_path):
    (tmp_path / "table.csv").write_text(TABLE)
    check_that_all_run(EXTRAS, COMMANDS, tmp_path)


@pytest.mark.slow
def test_the_demo_needs_no_numba(tmp_path):
    pytest.importorskip("pybullet")
    check_that_all_run(["numba"], ["demo --actions 2 --output out"], tmp_path)
