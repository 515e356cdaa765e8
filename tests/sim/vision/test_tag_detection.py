import numpy as np
import pytest

from atg_fg.core.patterns import MISSING
from atg_fg.senses.tags import DetectedTag, TagPose
from sim.bodies.cube import CUBE_CENTRE, CUBE_SIZE
from sim.vision.camera import Camera, Light
from sim.vision.tag_detection import detect_markers, detected_symbols, draw_detections, slot_markers
from sim.worlds.rendered_world import RenderedARcubeWorld

FRONT, TOP, LEFT, TILTED = [-1, 0, 0], [0, 0, 1], [0, 1, 0], [-1, 0, 0.5]


def marker(symbol, normal):
    normal = np.array(normal, dtype=float) / np.linalg.norm(normal)
    rotation = np.column_stack([np.zeros(3), np.zeros(3), normal])
    corners = np.array([[40.0, 40], [80, 40], [80, 80], [40, 80]])
    return DetectedTag(symbol, symbol, corners, 0, np.zeros((5, 5)), TagPose(np.zeros(3), rotation))


@pytest.fixture
def world():
    made = RenderedARcubeWorld(render_mode="rgb_array")
    yield made
    made.close()


@pytest.mark.parametrize(
    ("markers", "symbols"),
    [
        ([], (MISSING, MISSING)),
        ([marker(3, FRONT)], (3, MISSING)),
        ([marker(5, TOP)], (MISSING, 5)),
        ([marker(5, TOP), marker(3, FRONT)], (3, 5)),
        ([marker(7, LEFT), marker(3, FRONT)], (3, MISSING)),
        ([marker(2, TILTED), marker(3, FRONT)], (3, MISSING)),
        ([marker(4, FRONT), marker(4, TOP)], (MISSING, MISSING)),
    ],
    ids=["nothing", "front", "top", "both", "a side is no slot", "the best aligned", "one tag twice is an error"],
)
def test_slots_go_to_the_markers_that_face_them(markers, symbols):
    assert detected_symbols(markers) == symbols


def test_an_empty_frame_shows_nothing():
    assert detect_markers(np.full((240, 320, 3), 200, dtype=np.uint8), Camera()) == []


def test_pose_of_the_cube_is_measured_to_a_centimetre(world):
    camera = Camera(image_size=(640, 480))
    for orientation in range(0, 24, 5):
        world.reset(seed=0, options={"object": 1, "orientation": orientation})
        markers = detect_markers(camera.render(world._client, Light()), camera)
        assert len(markers) == 2
        top = slot_markers(markers)["top"]
        assert np.linalg.norm(top.behind(CUBE_SIZE / 2) - CUBE_CENTRE) < 0.01
        assert top.normal @ [0, 0, 1] > np.cos(np.radians(3))


def test_drawing_marks_the_detections_and_leaves_the_frame_alone(world):
    world.reset(seed=0)
    before = world.frame.copy()
    drawn = draw_detections(world.frame, world.markers)
    np.testing.assert_array_equal(world.frame, before)
    assert (drawn != before).any()
    assert drawn.shape == before.shape


def test_the_camera_looks_along_its_axis():
    camera = Camera()
    np.testing.assert_allclose(camera.rotation.T @ camera.rotation, np.eye(3), atol=1e-12)
    assert np.linalg.det(camera.rotation) == pytest.approx(1)
    seen = camera.rotation.T @ (np.array(camera.target) - camera.eye)
    np.testing.assert_allclose(seen[:2], 0, atol=1e-12)
    assert seen[2] > 0


def test_pose_holds_to_a_centimetre_from_both_tags_under_jitter_and_noise():
    made = RenderedARcubeWorld(position_jitter=0.02, yaw_jitter=5.0, image_noise=10.0)
    for seed in range(24):
        _, truth = made.reset(seed=seed, options={"orientation": seed})
        slots = slot_markers(made.markers).values()
        centre = np.mean([found.behind(CUBE_SIZE / 2) for found in slots if found is not None], axis=0)
        assert np.linalg.norm(centre - truth["position"]) < 0.01
    made.close()
