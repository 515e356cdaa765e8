import json

import pytest

cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed: pip install atg-fg[vision]")

from tests.senses.test_camera_calibration import HELD, picture


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    folder = tmp_path_factory.mktemp("board")
    for number, held in enumerate(HELD[:6]):
        cv2.imwrite(str(folder / f"{number}.png"), picture(held))
    return sorted(folder.glob("*.png"))


def test_a_camera_is_calibrated_and_the_file_is_taken_by_look(run, pictures, tmp_path):
    output = tmp_path / "camera.json"
    status, printed, _ = run("camera", "calibrate", *pictures, "-o", output)
    assert status == 0
    assert "6 pictures show the board; its corners lie 0." in printed
    assert json.loads(output.read_text())["intrinsics"][0][0] == pytest.approx(610, abs=4)
    assert run("look", pictures[0], "--calibration", output)[0] == 0


def test_a_video_of_the_board_does_as_well(run, pictures, tmp_path):
    video = tmp_path / "board.avi"
    writer = cv2.VideoWriter(str(video), cv2.VideoWriter_fourcc(*"MJPG"), 30, (640, 480))
    for path in pictures:
        for _ in range(15):
            writer.write(cv2.imread(str(path)))
    writer.release()
    status, printed, _ = run("camera", "calibrate", "--video", video, "-o", tmp_path / "camera.json")
    assert status == 0
    assert "6 pictures show the board" in printed


def test_bad_input_is_one_line_and_writes_nothing(refused, pictures, tmp_path):
    output = tmp_path / "camera.json"
    assert "seen in 2 of 2 pictures; expected at least 5" in refused("camera", "calibrate", *pictures[:2], "-o", output)
    assert "expected pictures of the board, or --video FILE" in refused("camera", "calibrate", "-o", output)
    assert "expected smaller tags" in refused("camera", "calibrate", *pictures, "--tag", "40", "-o", output)
    assert "no such file; expected a video" in refused("camera", "calibrate", "--video", "no.mp4", "-o", output)
    assert not output.exists()
