"""The live loop on pictures and videos of cubes that are turned; what a person says comes from standard input."""

import io
import json
import sys
import time
import urllib.request

import numpy as np
import pytest

cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed: pip install atg-fg[vision]")

from atg_fg.senses import frame_reader
from atg_fg.storage.memory_files import load_memory
from atg_fg.worlds.arcube import ACTION_ROTATIONS
from tests.senses.images import INTRINSICS, cube_picture

FIRST, SECOND = (0, 1, 2, 3, 4, 5), (6, 7, 8, 9, 10, 11)
BLANK = np.full((480, 640, 3), 120, dtype=np.uint8)


@pytest.fixture
def tags(tmp_path):
    """Files of two cubes' tags and of the camera."""
    about = {"format": "atg-fg/tags", "version": 1, "dictionary": "5X5_50", "size_metres": 0.042}
    path = tmp_path / "cubes.json"
    path.write_text(json.dumps({**about, "ids": list(range(12)), "cubes": [FIRST, SECOND]}))
    lens = {"intrinsics": INTRINSICS.tolist(), "distortion": [0, 0, 0, 0, 0], "image_size": [640, 480]}
    (tmp_path / "camera.json").write_text(json.dumps({"format": "atg-fg/camera", "version": 1, **lens}))
    return ["--tags", path, "--calibration", tmp_path / "camera.json"]


@pytest.fixture
def pictures(tmp_path):
    """Write pictures of cubes, each turned by actions one after the other, with an empty table after each."""

    def made(*trials, name="pictures"):
        folder = tmp_path / name
        folder.mkdir()
        frames = []
        for faces, start, *actions in trials:
            cube = start
            frames.append(cube_picture(faces, cube))
            for action in actions:
                cube = ACTION_ROTATIONS[action] @ cube
                frames.append(cube_picture(faces, cube))
            frames.append(BLANK)
        for number, frame in enumerate(frames):
            cv2.imwrite(str(folder / f"{number:03d}.png"), cv2.cvtColor(frame, cv2.COLOR_RGB2BGR))
        return folder

    return made


def trials(output):
    return json.loads(output)["trials"]


def test_cubes_are_learned_and_recognised_from_a_folder_of_pictures(run, pictures, tags, tmp_path):
    learned = pictures(
        (FIRST, np.eye(3), "flip", "left", "left", "flip"),
        (SECOND, np.eye(3), "right", "flip", "left"),
    )
    memory = tmp_path / "robot.db"
    status, output, _ = run("live", "--images", learned, *tags, "--memory", memory, "--learn", "--json", "-")
    assert status == 0
    assert [(trial["verdict"], trial["learned"]) for trial in trials(output)] == [
        ("novel", "object-000"),
        ("novel", "object-001"),
    ]
    assert [step["action"] for step in trials(output)[0]["steps"]] == ["flip", "left", "left", "flip", None]
    assert len(load_memory(memory)) == 2
    again = pictures(
        (SECOND, np.eye(3), "right", "flip"), (FIRST, ACTION_ROTATIONS["flip"], "left", "left"), name="again"
    )
    status, output, _ = run("live", "--images", again, *tags, "--memory", memory, "--json", "-")
    assert [(trial["matched"], trial["learned"]) for trial in trials(output)] == [
        ("object-001", None),
        ("object-000", None),
    ]
    assert len(load_memory(memory)) == 2


def test_what_is_seen_believed_and_to_be_done_is_told(run, pictures, tags, tmp_path):
    folder = pictures((FIRST, np.eye(3), "flip", "left"))
    status, output, _ = run("live", "--images", folder, *tags, "--learn", "--draw", tmp_path / "seen")
    assert status == 0
    for line in ("look 0: front 0, top 4", "turned: flip", "look 1: front 4, top 1", "verdict: a new object"):
        assert line in output
    assert "to learn more of it, do: " in output
    assert "learned: object-000" in output
    drawn = cv2.imread(str(tmp_path / "seen" / "look-0002.png"))
    assert (drawn != cv2.imread(str(folder / "002.png"))).any()


def test_a_memory_in_a_json_file_is_made_and_gone_on_with(run, pictures, tags, tmp_path):
    folder = pictures((FIRST, np.eye(3), "flip"))
    memory = tmp_path / "robot.json"
    run("live", "--images", folder, *tags, "--memory", memory, "--learn")
    assert len(load_memory(memory)) == 1
    before = memory.read_bytes()
    run("live", "--images", folder, *tags, "--memory", memory)
    assert memory.read_bytes() == before


def test_two_turns_between_two_pictures_are_two_actions_with_nothing_seen_between(run, pictures, tags):
    folder = pictures((FIRST, np.eye(3), "left", "left"))
    (folder / "001.png").unlink()
    _, output, _ = run("live", "--images", folder, *tags, "--json", "-")
    steps = trials(output)[0]["steps"]
    assert [step["observed"] for step in steps] == [[0, 4], [None, None], [1, 4]]
    assert [step["action"] for step in steps] == ["left", "left", None]


@pytest.fixture
def turned_unseen(pictures):
    """Flipped and turned at once, so that no tag is seen that was seen before."""
    folder = pictures((FIRST, np.eye(3), "flip", "left"))
    (folder / "001.png").unlink()
    return folder


def test_a_turn_that_was_not_seen_ends_the_trial_where_nobody_is_asked(run, turned_unseen, tags):
    status, output, _ = run("live", "--images", turned_unseen, *tags)
    assert status == 0
    assert "note: it was not seen how the cube was turned: the trial ends here, and another begins" in output
    assert output.count("verdict:") == 2


@pytest.mark.parametrize(("said", "actions"), [("right\n", ["right", None]), ("jump\nflip\n", ["flip", None])])
def test_a_turn_that_was_not_seen_is_asked_for(run, turned_unseen, tags, monkeypatch, said, actions):
    monkeypatch.setattr(sys, "stdin", io.StringIO(said))
    _, output, error = run("live", "--images", turned_unseen, *tags, "--ask", "--json", "-")
    assert "how was the cube turned? flip, left, right, nothing, new" in error
    assert [step["action"] for step in trials(output)[0]["steps"]] == actions


def test_after_the_last_line_of_input_nobody_is_waited_for(run, turned_unseen, tags, monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.StringIO(""))
    status, output, _ = run("live", "--images", turned_unseen, *tags, "--ask")
    assert status == 0
    assert output.count("verdict:") == 2


@pytest.mark.parametrize(("said", "learned"), [("learn\n", ["object-000"]), ("quit\n", [None])])
def test_a_person_can_have_a_trial_learned_and_end_the_session(run, pictures, tags, monkeypatch, said, learned):
    monkeypatch.setattr(sys, "stdin", io.StringIO(said))
    monkeypatch.setattr("atg_fg.cli.live.Thread", Immediately)
    folder = pictures((FIRST, np.eye(3), "flip"))
    status, output, _ = run("live", "--images", folder, *tags, "--ask", "--json", "-")
    assert status == 0
    assert [trial["learned"] for trial in trials(output)] == learned


class Immediately:
    """A thread that has done its work when it is started, so that a test does not depend on which comes first."""

    def __init__(self, target, args, daemon):
        self.start = lambda: target(*args)


def bad(name, folder):
    """A video that does not show what it should."""
    writer = cv2.VideoWriter(str(folder / name), cv2.VideoWriter_fourcc(*"MJPG"), 10, (640, 480))
    strangers = cube_picture((20, 21, 22, 23, 24, 25), np.eye(3))
    twice = cube_picture((0, 1, 2, 3, 0, 5), np.eye(3))
    shown = {"strangers.avi": strangers, "twice.avi": twice, "table.avi": BLANK}[name]
    for _ in range(8):
        writer.write(cv2.cvtColor(shown, cv2.COLOR_RGB2BGR))
    writer.release()
    return folder / name


@pytest.mark.parametrize(
    ("video", "message"),
    [
        ("strangers.avi", "no cube was seen at rest: tags 20, 24 are none of the tags that count"),
        ("twice.avi", "no cube was seen at rest: tag 0 is in view twice: it is not believed"),
        ("table.avi", "no cube was seen at rest; expected one with the tags that count"),
    ],
)
def test_a_video_without_a_cube_that_counts_is_one_line(run, tmp_path, tags, video, message):
    status, _, error = run("live", "--video", bad(video, tmp_path), *tags)
    assert status == 2
    assert error.count("\n") == 1
    assert message in error


def test_bad_input_is_one_line(refused, tmp_path, tags, pictures):
    video = bad("table.avi", tmp_path)
    small = tmp_path / "small.avi"
    writer = cv2.VideoWriter(str(small), cv2.VideoWriter_fourcc(*"MJPG"), 10, (320, 240))
    writer.write(np.zeros((240, 320, 3), dtype=np.uint8))
    writer.release()
    (tmp_path / "text.mp4").write_text("no video")
    (tmp_path / "empty").mkdir()
    file = tags[1]
    assert "no such camera" in refused("live", "--camera", 63, *tags)
    assert "small.avi: 320 by 240 pixels; expected 640 by 480" in refused("live", "--video", small, *tags)
    assert "text.mp4: not a video" in refused("live", "--video", tmp_path / "text.mp4", *tags)
    assert "no images in this folder" in refused("live", "--images", tmp_path / "empty", *tags)
    assert "no such file; expected a video" in refused("live", "--video", "nowhere.avi", *tags)
    assert "2 sources of frames; expected one of" in refused("live", "--camera", 0, "--video", video, *tags)
    over = refused("live", "--video", video, *tags, "--json", video)
    assert "is the file of --video too, and would be overwritten" in over
    assert "0 sources of frames" in refused("live", *tags)
    assert "live: no tags; expected --tags FILE" in refused("live", "--video", video)
    assert "unknown name 'nope'" in refused("live", "--video", video, "--dictionary", "nope")
    assert "expected 0 to below 90 degrees" in refused("live", "--video", video, *tags, "--pitch", "95")
    assert "expected seconds above 0" in refused("live", "--video", video, *tags, "--timeout", "0")
    memory = tmp_path / "other.json"
    folder = pictures((FIRST, np.eye(3)))
    run_with = ("live", "--images", folder, "--dictionary", "4X4_50", "--memory", memory)
    memory.write_text(file.read_text())
    assert "other.json" in refused(*run_with)


def test_a_memory_of_other_tags_is_refused(run, refused, tmp_path, tags, pictures):
    folder = pictures((FIRST, np.eye(3), "flip"))
    memory = tmp_path / "robot.json"
    run("live", "--images", folder, *tags, "--memory", memory, "--learn")
    document = json.loads(tags[1].read_text())
    tags[1].write_text(json.dumps({**document, "ids": list(range(14))}))
    line = refused("live", "--images", folder, *tags, "--memory", memory)
    assert "memory: number of symbols 12; expected 14, those of the cubes before the camera" in line


def test_a_camera_that_hangs_is_given_up(refused, tmp_path, tags, monkeypatch):
    hangs = tmp_path / "hangs.py"
    hangs.write_text("import time\ntime.sleep(60)\n")
    monkeypatch.setattr(frame_reader, "__file__", str(hangs))
    begun = time.monotonic()
    assert "camera 0: no frame within 0.5 s" in refused("live", "--camera", 0, *tags, "--timeout", "0.5")
    assert time.monotonic() - begun < 10


def test_the_page_is_served_while_the_session_goes_on(run, pictures, tags, monkeypatch, capsys):
    from atg_fg.display import live_page

    seen = []
    showing = live_page.LivePage.show

    def show(page, state, picture):
        showing(page, state, picture)
        with urllib.request.urlopen(page.address + "state") as answer:
            seen.append(json.load(answer))

    monkeypatch.setattr(live_page.LivePage, "show", show)
    status, output, _ = run("live", "--images", pictures((FIRST, np.eye(3), "flip")), *tags, "--page", "0")
    assert status == 0
    assert "page: http://127.0.0.1:" in output
    assert seen[0]["seen"] == "front 0, top 4"
    assert seen[-1]["say"] == "that was a new object; next cube, please"
