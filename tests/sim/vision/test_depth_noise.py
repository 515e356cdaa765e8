import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from sim.vision.depth_noise import noisy_depth
from sim.vision.image_noise import Imaging

FOCAL = 322.0


def a_wall(distance, tangent=0.0, size=(200, 260)):
    """Return the depth of a plane that is seen at an angle."""
    height, width = size
    across = (np.arange(width) - width / 2) / FOCAL
    return np.tile(distance / (1 - tangent * across), (height, 1)).astype(np.float32)


@pytest.mark.parametrize(("distance", "spread"), [(0.4, 0.0012), (1.0, 0.001884), (2.0, 0.006064)])
def test_noise_of_a_wall_ahead_is_as_published(distance, spread):
    wall = a_wall(distance)
    scale, rest = [], []
    for seed in range(40):
        seen = noisy_depth(wall, FOCAL, 1.0, np.random.default_rng(seed))
        measured = seen[seen > 0]
        scale.append(measured.mean() / distance)
        rest.append(measured.std())
    assert np.mean(rest) == pytest.approx(spread, rel=0.03)
    assert np.std(scale) == pytest.approx(0.002, rel=0.5)


def test_what_is_seen_slantwise_is_noisier_and_then_lost():
    rng = np.random.default_rng(0)
    ahead, slant, steep = (noisy_depth(a_wall(1.0, tangent), FOCAL, 1.0, rng) for tangent in (0.0, 2.0, 8.0))
    columns = slice(120, 140)
    off = [(seen - a_wall(1.0, tangent))[:, columns] for seen, tangent in ((ahead, 0.0), (slant, 2.0))]
    assert off[1][slant[:, columns] > 0].std() > 1.2 * off[0][ahead[:, columns] > 0].std()
    assert (steep[:, columns] == 0).all()


def test_nothing_stays_nothing_and_edges_before_it_are_lost():
    depth = np.zeros((100, 100), dtype=np.float32)
    depth[:, 50:] = 0.8
    seen = noisy_depth(depth, FOCAL, 1.0, np.random.default_rng(0))
    assert (seen[:, :46] == 0).all()
    assert (seen[:, 50] == 0).all()
    assert (seen[:, 54:] > 0).mean() > 0.98


def test_the_same_generator_gives_the_same_image_and_no_noise_none():
    wall = a_wall(0.7)
    first, again = (noisy_depth(wall, FOCAL, 1.0, np.random.default_rng(3)) for _ in range(2))
    assert (first == again).all()
    assert (noisy_depth(wall, FOCAL, 0.0, np.random.default_rng(3)) == wall).all()


def test_less_than_no_noise_is_refused():
    with pytest.raises(InvalidInputError, match=r"depth_noise: -1\.0; expected a finite number"):
        Imaging(depth_noise=-1.0)
