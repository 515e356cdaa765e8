import numpy as np
import pybullet
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.errors import InvalidInputError
from atg_fg.worlds.arcube import rotation_of
from sim.bodies.cube import CUBE_CENTRE, CubeBody
from sim.vision.camera import Camera, Light
from sim.vision.image_noise import Imaging, at_least_zero

NAMES = ["light_jitter", "image_noise", "blur"]


class Picture:
    """A camera that always sees the same, and keeps the lights that it was rendered in."""

    def __init__(self, grey, *, shape=(120, 160)):
        self.frame = np.empty((*shape, 3), dtype=np.uint8)
        self.frame[:] = np.reshape(grey, (*np.shape(grey), 1))
        self.lights = []

    def render(self, client, light):
        self.lights.append(light)
        return self.frame.copy()


@pytest.fixture
def client():
    made = pybullet.connect(pybullet.DIRECT)
    cube = CubeBody(made)
    cube.show((0, 1, 2, 3, 4, 5))
    cube.place(CUBE_CENTRE, rotation_of(0))
    yield made
    pybullet.disconnect(physicsClientId=made)


def seen(imaging, picture, seed=0):
    return imaging.frame(picture, 0, np.random.default_rng(seed))


def test_what_is_zero_draws_nothing_and_changes_nothing():
    picture, rng = Picture(128), np.random.default_rng(0)
    before = rng.bit_generator.state
    np.testing.assert_array_equal(Imaging().frame(picture, 0, rng), picture.frame)
    assert rng.bit_generator.state == before
    assert picture.lights == [Light()]


def test_a_blur_draws_nothing():
    rng = np.random.default_rng(0)
    before = rng.bit_generator.state
    Imaging(blur=1.0).frame(Picture(128), 0, rng)
    assert rng.bit_generator.state == before


@pytest.mark.parametrize("name", ["light_jitter", "image_noise"])
def test_light_and_noise_are_drawn(name):
    rng = np.random.default_rng(0)
    before = rng.bit_generator.state
    Imaging(**{name: 0.5}).frame(Picture(128), 0, rng)
    assert rng.bit_generator.state != before


@pytest.mark.parametrize("deviation", [2.0, 5.0, 20.0])
def test_noise_has_the_standard_deviation_that_is_asked_for(deviation):
    frame = seen(Imaging(image_noise=deviation), Picture(128))
    error = frame[:, :, 0].astype(float) - 128
    # Rounding to whole grey levels adds 1/12 to the variance.
    assert error.std() == pytest.approx(np.sqrt(deviation**2 + 1 / 12), rel=0.03)
    assert abs(error.mean()) < 4 * deviation / np.sqrt(error.size)


def test_noise_is_grey_and_different_at_every_pixel():
    frame = seen(Imaging(image_noise=20.0), Picture(128)).astype(float)
    assert (frame == frame[:, :, :1]).all()
    noise = frame[:, :, 0] - 128
    for axis in range(2):
        neighbours = (noise * np.roll(noise, 1, axis=axis)).mean() / noise.var()
        assert abs(neighbours) < 4 / np.sqrt(noise.size)


@pytest.mark.parametrize("grey", [0, 255])
def test_noise_does_not_turn_white_to_black(grey):
    frame = seen(Imaging(image_noise=20.0), Picture(grey)).astype(int)
    assert np.abs(frame - grey).max() < 20 * 6
    assert (frame == grey).mean() == pytest.approx(0.5, abs=0.03)


def test_a_blur_softens_an_edge_by_its_standard_deviation():
    step = np.zeros((120, 160))
    step[:, 80:] = 200
    row = seen(Imaging(blur=3.0), Picture(step))[60, :, 0].astype(float)
    assert row[:60].tolist() == [0] * 60
    assert row[100:].tolist() == [200] * 60
    assert (np.diff(row) >= 0).all()
    # The steps of a blurred edge are a Gaussian about it.
    rises, places = np.diff(row) / 200, np.arange(159) - 79
    assert np.sqrt((rises * places**2).sum()) == pytest.approx(3.0, abs=0.15)


def test_noise_comes_after_the_blur():
    both, noise = (seen(Imaging(image_noise=10.0, blur=blur), Picture(128)) for blur in (3.0, 0.0))
    np.testing.assert_array_equal(both, noise)


@given(jitter=st.floats(0.01, 1), seed=st.integers(0, 1000))
def test_the_light_changes_no_more_than_it_may(jitter, seed):
    picture = Picture(128, shape=(2, 2))
    Imaging(light_jitter=jitter).frame(picture, 0, np.random.default_rng(seed))
    (light,) = picture.lights
    change = np.subtract(light.direction, Light().direction)
    assert np.abs(change[:2]).max() <= jitter + 1e-12
    assert change[2] == 0
    assert light.ambient == Light().ambient
    assert light.diffuse == pytest.approx(Light().diffuse, rel=jitter / 2 + 1e-9)
    assert light != Light()


def test_the_light_changes_from_look_to_look():
    picture, rng, imaging = Picture(128), np.random.default_rng(0), Imaging(light_jitter=0.5)
    for _ in range(5):
        imaging.frame(picture, 0, rng)
    assert len(set(picture.lights)) == 5


@pytest.mark.parametrize(
    "imaging", [Imaging(light_jitter=0.5), Imaging(image_noise=10), Imaging(0.6, 20.0, 0.7)], ids=str
)
def test_the_same_seed_gives_the_same_frame_and_another_one_does_not(client, imaging):
    camera = Camera(image_size=(80, 60))
    first, again, other = (imaging.frame(camera, client, np.random.default_rng(seed)) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_a_frame_is_what_the_camera_renders(client):
    camera = Camera(image_size=(80, 60))
    plain = Imaging().frame(camera, client, np.random.default_rng(0))
    np.testing.assert_array_equal(plain, camera.render(client, Light()))
    for imaging in (Imaging(image_noise=10), Imaging(blur=1)):
        frame = imaging.frame(camera, client, np.random.default_rng(0))
        assert frame.shape == (60, 80, 3)
        assert frame.dtype == np.uint8
        assert not np.array_equal(frame, plain)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("value", [-0.1, -1e-300, np.nan, np.inf, -np.inf])
def test_a_value_that_cannot_be_is_refused_by_its_name(name, value):
    with pytest.raises(InvalidInputError, match=f"{name}: {value!r}; expected a finite number of at least 0"):
        Imaging(**{name: value})


@given(st.floats(0, 1e300))
def test_what_is_at_least_zero_is_given_back(value):
    assert at_least_zero("blur", value) == value
    assert isinstance(at_least_zero("blur", 3), float)
