"""The guides to objects, agents and loops of one's own: their Python and their commands run as they are printed."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import gymnasium
import pytest
from gymnasium.utils.env_checker import check_env

from atg_fg import Assumptions, PatternAlphabet, load_memory
from atg_fg.storage.memory_files import open_memory

DOCS = Path(__file__).parents[1] / "docs"


def blocks(name, language="python"):
    return re.findall(rf"```{language}\n(.*?)```", (DOCS / name).read_text(), re.DOTALL)


def run(code, name, variables):
    exec(compile(code, name, "exec"), variables)


#: What Python is given to run commands, one after the other: to begin it for each takes longer than they do.
SESSION = """
import json, sys
from atg_fg.cli import main
for command in json.loads(sys.argv[1]):
    sys.argv = command
    try:
        main()
    except SystemExit as end:
        assert not end.code, command
"""


def on_the_command_line(commands, folder, *shorter):
    """Run commands as they are printed, with Python's path from the folder; a table is made a shorter one."""
    given = [shlex.split(command) for command in commands]
    given = [[*words, *shorter] if words[1] == "table1" else words for words in given]
    assert {words[0] for words in given} == {"atg-fg"}
    done = subprocess.run(
        [sys.executable, "-c", SESSION, json.dumps(given)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": f"{folder}{os.pathsep}{DOCS.parent}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


@pytest.fixture
def cups(tmp_path, monkeypatch):
    """What the guide to one's own object leaves behind, in its folder."""
    monkeypatch.chdir(tmp_path)
    variables = {"__name__": "cups"}
    yield tmp_path, variables
    gymnasium.registry.pop("TeaCup-v0", None)


def test_every_page_is_in_the_table_of_contents():
    listed = set(re.findall(r"^(\w+)$", (DOCS / "index.md").read_text(), flags=re.MULTILINE))
    assert {page.stem for page in DOCS.glob("*.md")} - {"index"} <= listed


def test_the_first_trial_runs_from_top_to_bottom(capsys):
    variables = {}
    for code in blocks("first_trial.md"):
        run(code, "first_trial.md", variables)
    assert "RobotMemory(" in capsys.readouterr().out


def test_the_guide_to_ones_own_object_makes_a_world_in_forty_lines(cups):
    _, variables = cups
    world = blocks("bring_your_own_object.md")[0]
    assert len(world.splitlines()) <= 40
    run(world, "teacup.py", variables)
    check_env(variables["TeaCup"](), skip_render_check=True)


def test_the_robot_learns_those_objects_recognises_them_and_saves_them(cups, capsys):
    folder, variables = cups
    for code in blocks("bring_your_own_object.md"):
        run(code, "guide", variables)
    remembered = int(re.search(r"# RobotMemory\((\d+) of 12", code)[1])
    assert f"RobotMemory({remembered} of 12 objects)" in capsys.readouterr().out
    assert len(load_memory(folder / "cups.json")) == remembered
    last = variables["record"]
    assert last.verdict == "known"


def test_the_commands_take_the_world_from_a_file(cups):
    folder, _ = cups
    (folder / "teacup.py").write_text(blocks("bring_your_own_object.md")[0])
    _, *commands = blocks("bring_your_own_object.md", "sh")[0].splitlines()
    assert len(commands) == 3
    on_the_command_line(commands, folder, "--tests", "1", "--trials", "5", "--jobs", "1")
    assert load_memory(folder / "cups.json").assumptions.actions == ("turn", "invert")


def test_the_guide_to_ones_own_engine_runs_and_prints_what_it_says(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    engine, *others = blocks("your_engine.md")
    (tmp_path / "my_engine.py").write_text(engine)
    module = ModuleType("my_engine")
    monkeypatch.setitem(sys.modules, "my_engine", module)
    run(engine, "my_engine.py", variables := vars(module))
    for code, printed in zip(others, blocks("your_engine.md", "text"), strict=True):
        run(code, "your_engine.md", variables)
        assert capsys.readouterr().out == printed
    path, *commands = blocks("your_engine.md", "sh")[0].splitlines()
    assert path == "export PYTHONPATH=."
    on_the_command_line(commands, tmp_path)
    assert len(load_memory(tmp_path / "cubes.json")) == 1


def test_the_loops_of_the_document_on_agents_run(capsys):
    task, _, _, agent = blocks("agents.md")
    run(task, "agents.md", variables := {})
    assert capsys.readouterr().out.split()[1] in ("novel", "known")
    variables["task"].close()
    run(agent, "agents.md", variables := {})
    assert "judged known, object-003" in capsys.readouterr().out
    assert variables["agent"].trials == []


@pytest.mark.peers
@pytest.mark.filterwarnings("ignore")
def test_our_recogniser_does_a_task_of_active_perception_gym(capsys):
    pytest.importorskip("ap_gym", reason="ap_gym is not installed: pip install atg-fg[ap-gym]")
    run(blocks("agents.md")[2], "agents.md", {})
    assert capsys.readouterr().out == blocks("agents.md", "text")[0]


@pytest.mark.peers
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning", "ignore::UserWarning")
def test_an_agent_of_stable_baselines3_is_trained_and_scored(tmp_path, monkeypatch, capsys):
    pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed: pip install atg-fg[agents]")
    monkeypatch.chdir(tmp_path)
    task, agent, *_ = blocks("agents.md")
    run(task + agent, "agents.md", {})
    assert "TestResult(seed=0" in capsys.readouterr().out
    module, command = blocks("agents.md", "sh")[0].splitlines()
    (tmp_path / "my_agent.py").write_text(module.split("'")[1].replace("\\n", "\n"))
    on_the_command_line(
        [command.removeprefix("PYTHONPATH=. ")], tmp_path, "--tests", "1", "--trials", "3", "--jobs", "1"
    )


@pytest.fixture
def webcam_guide(tmp_path):
    """Run the commands of the guide to webcams, shorter ones if a function is given; return their output."""
    for needed in ("cv2", "pybullet", "matplotlib"):
        pytest.importorskip(needed)
    folder = tmp_path

    def run_commands(shortened=lambda words: words):
        printed = []
        for block in blocks("with_a_webcam.md", "sh"):
            for command in block.splitlines():
                program, *words = shortened(shlex.split(command))
                done = subprocess.run(
                    [Path(sys.executable).with_name(program), *words],
                    cwd=folder,
                    capture_output=True,
                    text=True,
                    check=False,
                )
                assert done.returncode == 0, f"{command}: {done.stderr}"
                printed.append(done.stdout)
        return printed, folder

    return run_commands


@pytest.mark.slow
def test_the_guide_to_webcams_runs_as_it_is_printed_with_shorter_films(webcam_guide, monkeypatch, capsys):
    def shortened(words):
        return [*words, "--trials", "1", "--actions", "1"] if words[1] == "sim" else words

    (sheets, *_, learned, recognised), folder = webcam_guide(shortened)
    assert "told apart after 0.00 actions on average" in sheets
    assert "learned: object-000" in learned
    assert "memory: robot.db, 1 objects" in recognised
    monkeypatch.chdir(folder)
    (code,) = blocks("with_a_webcam.md")
    run(code, "with_a_webcam.md", {})
    assert capsys.readouterr().out.startswith("{'front': (")


@pytest.mark.slow
def test_the_guide_to_webcams_comes_to_the_verdicts_that_it_tells(webcam_guide):
    (*_, learned, recognised), _ = webcam_guide()
    assert re.findall(r"learned: (\S+)", learned) == ["object-000", "object-001", "object-002"]
    told = re.search(r"after two turns each: `(\S+)`, `(\S+)`, `(\S+)`", (DOCS / "with_a_webcam.md").read_text())
    assert re.findall(r"verdict: (\S+)", recognised) == list(told.groups())


@pytest.mark.slow
def test_the_guides_to_ones_own_data_print_what_they_say(tmp_path, monkeypatch):
    for needed in ("numba", "jinja2"):
        pytest.importorskip(needed)
    monkeypatch.syspath_prepend(DOCS)
    import tour

    shown = [*blocks("your_data.md", "console"), *blocks("noisy_detectors.md", "console")]
    for command in [command for block in shown for command in tour.commands_in(block)]:
        done = tour.run(command.line, tmp_path)
        assert done.returncode == 0, f"{command.line}: {done.stderr}"
        lines = tour.printed(done.stdout)
        assert lines[: len(command.output)] == command.output, command.line
        assert lines == command.output if not command.cut else lines[-len(command.end) :] == command.end, command.line
    assert "barcode" in (tmp_path / "page.html").read_text()


def test_the_bag_of_the_guide_is_read_by_its_topics(tmp_path):
    from atg_fg.storage.rosbag_recordings import read_topics

    _, topics = blocks("your_data.md", "json")
    (tmp_path / "topics.json").write_text(topics)
    found = read_topics(tmp_path / "topics.json")
    assert found.slots["label"].topic == "/detections"
    assert (found.action.label, found.trial.topic) == ("data", "/trial")


def test_the_guide_says_what_is_known_of_a_weight(tmp_path):
    from atg_fg.storage.recordings import read_recording, read_spec

    senses, _ = blocks("your_data.md", "json")
    (tmp_path / "spec.json").write_text(senses)
    (rows,) = blocks("your_data.md", "text")
    (tmp_path / "looks.csv").write_text(rows)
    recording = read_recording(tmp_path / "looks.csv", read_spec(tmp_path / "spec.json"))
    (weight,) = recording.senses
    assert (weight.name, weight.revealed_by) == ("weight", ("lift",))
    assert recording.trials[0].readings_of("weight") == [0.74]


def test_the_formats_page_shows_a_recording_that_is_read(tmp_path):
    from atg_fg.storage.recordings import read_recording

    (lines,) = [block for block in blocks("file_formats.md", "json") if "atg-fg/recording" in block]
    (tmp_path / "looks.jsonl").write_text(lines)
    (trial,) = read_recording(tmp_path / "looks.jsonl").trials
    assert (trial.name, trial.object, trial.actions) == ("0", "cup", ("rotate",))
    assert trial.looks[1].weights == ({"lid": 0.2, "logo": 0.8},)


def test_a_robots_own_loop_prints_what_the_guide_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    variables = {}
    codes = blocks("live_robot.md")
    del codes[2]  # of ROS
    for code, printed in zip(codes, blocks("live_robot.md", "text"), strict=True):
        run(code, "live_robot.md", variables)
        assert capsys.readouterr().out == printed
    variables["memory"].close()
    run(blocks("live_robot.md")[0], "live_robot.md", {})  # another day
    assert "known" in capsys.readouterr().out


def test_the_ros_node_recognises_what_its_detector_says(tmp_path, monkeypatch):
    """``rclpy`` is replaced by the three calls of it that the node makes: subscribe, publish, spin."""
    monkeypatch.chdir(tmp_path)
    alphabet = PatternAlphabet.named(("front",), ("logo", "text", "lid"), exclusive=False)
    open_memory("robot.db", Assumptions(5, 3, ("rotate", "tip"), alphabet)).close()
    published, heard = [], {}

    class Publisher:
        def __init__(self, topic):
            self.topic = topic

        def publish(self, message):
            published.append((self.topic, message.data))

    class Node:
        def __init__(self, name):
            assert name == "recogniser"

        def create_subscription(self, kind, topic, callback, depth):
            heard[topic] = callback

        def create_publisher(self, kind, topic, depth):
            return Publisher(topic)

    def say(topic, data):
        heard[topic](SimpleNamespace(data=data))

    def spin(node):
        labels = ["logo", "text", "lid"]
        for _ in range(3):  # three trials of one object: each action shows the next label
            before = len(published)
            for place in range(8):
                say("label", labels[place % 3])
                if published and len(published) > before and published[-1][0] == "verdict":
                    break
                say("done", published[-1][1])
        node.memory.close()

    modules = {
        "rclpy": SimpleNamespace(init=lambda: None, spin=spin),
        "rclpy.node": SimpleNamespace(Node=Node),
        "std_msgs.msg": SimpleNamespace(String=lambda data: SimpleNamespace(data=data)),
    }
    for name, module in {**modules, "std_msgs": SimpleNamespace()}.items():
        monkeypatch.setitem(sys.modules, name, module)
    code = blocks("live_robot.md")[2]
    assert len(code.splitlines()) <= 40
    variables = {"__name__": "node"}
    run(code, "live_robot.md", variables)
    variables["main"]()
    verdicts = [data for topic, data in published if topic == "verdict"]
    assert verdicts[0] == "novel"
    with open_memory("robot.db", read_only=True) as memory:
        assert len(memory) >= 1
