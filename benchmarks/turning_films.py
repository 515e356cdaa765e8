"""How many turns of a cube before a webcam are noticed, and noticed right?

Run with ``python benchmarks/turning_films.py [FILMS]``. Each film is of one cube with ten turns drawn at random, seen
through a lens that bends lines, in light that wanders, with noise, blur, and a hand before it; ``hard`` has more of all
that, and a cube that stands more askew. Seeds from 0; 95 % Wilson intervals over all turns.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table

from atg_fg.core.statistics import wilson_interval
from atg_fg.senses.tags import TagDetector, Tags
from atg_fg.senses.turns import CubeAtRest, TurnWatcher
from atg_fg.worlds.arcube import ACTION_ROTATIONS
from sim.bodies.cube import TAG_SIZE, face_image
from sim.vision.turning_film import TurningFilm, Webcam

N_ACTIONS = 10
REST = 1.8  # s: a person waits until the look is told, which takes longer if one of the tags cannot be read
USUAL = Webcam()
CONDITIONS = {
    "usual": (USUAL, 8.0),
    "from 30 degrees": (replace(USUAL, pitch=30.0), 8.0),
    "from 60 degrees": (replace(USUAL, pitch=60.0), 8.0),
    "hard": (
        replace(USUAL, noise=12.0, exposure=0.9, light_period=2.0, distortion=(-0.35, 0.12, 0.002, -0.002, 0)),
        16.0,
    ),
}


def main() -> None:
    """Print the table."""
    n_films = int(sys.argv[1]) if len(sys.argv) > 1 else 6
    table = Table(title=f"{n_films} films of {N_ACTIONS} turns, seeds 0 to {n_films - 1}", title_justify="left")
    for heading in ("condition", "turns right", "95% interval", "looks with both tags"):
        table.add_column(heading, justify="right")
    for name, (webcam, askew) in CONDITIONS.items():
        right, both, looks = (
            sum(counts) for counts in zip(*(_film(webcam, askew, seed) for seed in range(n_films)), strict=True)
        )
        total = n_films * N_ACTIONS
        low, high = wilson_interval(right, total)
        table.add_row(name, f"{right}/{total}", f"{100 * low:.1f}-{100 * high:.1f}%", f"{both}/{looks}")
    Console(highlight=False, width=100).print(table)


def _film(webcam: Webcam, askew: float, seed: int) -> tuple[int, int, int]:
    """Return turns noticed right before the first error, looks in which both tags were seen, and looks."""
    symbols = {tag: tag for tag in range(6)}
    detector = TagDetector(Tags("5X5_50", TAG_SIZE, webcam.intrinsics, np.array(webcam.distortion), symbols))
    watcher = TurnWatcher(ACTION_ROTATIONS)
    actions = np.random.default_rng(seed).choice(list(ACTION_ROTATIONS), N_ACTIONS).tolist()
    film = TurningFilm([[face_image(tag) for tag in symbols]], webcam, seed, askew=askew, rest=REST)
    rests = []
    for number, frame in enumerate(film.frames(0, actions)):
        said = watcher.take(number / webcam.rate, detector.detect(frame))
        if isinstance(said, CubeAtRest):
            rests.append(said)
    film.close()
    noticed = [rest.turn for rest in rests[1:]]
    right = sum(found == (action,) for found, action in zip(noticed, actions, strict=False))
    both = sum(None not in rest.slots.values() for rest in rests)
    return right, both, len(rests)


if __name__ == "__main__":
    main()
