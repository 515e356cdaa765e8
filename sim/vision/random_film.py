"""A film of printed cubes, turned at random before a webcam, and the webcam's calibration."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.errors import InvalidInputError
from atg_fg.senses.camera_calibration import Calibration
from atg_fg.storage.camera_files import read_tags, write_calibration
from atg_fg.storage.plain_files import write_bytes_atomically
from atg_fg.worlds.arcube import ACTION_ROTATIONS, ORIENTATIONS, SUCCESSORS, rotation_of
from sim.bodies.cube import face_image
from sim.vision.turning_film import CODECS, TurningFilm, Webcam, write_video

Trial = tuple[int, tuple[str, ...]]


def film_cubes(
    tags: Path, output: Path, calibration: Path, n_trials: int, n_actions: int, seed: int, webcam: Webcam | None = None
) -> list[Trial]:
    """Film the cubes of a file of tags and return what was done: the cube of each trial, and its turns.

    Args:
        tags: The file.
        output: Video to write.
        calibration: File to write the calibration of the webcam to.
        n_trials: Cubes put down, each once before any comes again.
        n_actions: Turns of each.
        seed: Of all that is drawn.
        webcam: What the camera does to the picture.

    Raises:
        InvalidInputError: No file of tags, one without cubes, or a video that cannot be written.
    """
    known = read_tags(tags)
    if not known.cubes:
        raise InvalidInputError(f"{tags}: no cubes; expected a file that print cube wrote")
    if output.suffix.lower() not in CODECS:
        raise InvalidInputError(f"{output}: suffix {output.suffix!r}; expected one of: {', '.join(CODECS)}")
    rng = np.random.default_rng(seed)
    trials: list[Trial] = []
    starts: list[int] = []
    while len(trials) < n_trials:
        for cube in rng.permutation(len(known.cubes)).tolist():
            starts.append(int(rng.integers(len(ORIENTATIONS))))
            trials.append((cube, _turns(starts[-1], n_actions, rng)))
    trials = trials[:n_trials]
    faces = [[face_image(tag_id, known.dictionary) for tag_id in cube] for cube in known.cubes]
    film = TurningFilm(faces, webcam, seed)

    def frames() -> Iterator[NDArray[np.uint8]]:
        for (cube, turns), start in zip(trials, starts, strict=False):
            yield from film.frames(cube, turns, rotation_of(start))

    write_video(output, frames(), film.webcam.rate)
    film.close()
    lens = Calibration(film.webcam.intrinsics, np.array(film.webcam.distortion), film.webcam.image_size)
    write_bytes_atomically(calibration, (json.dumps(write_calibration(lens), indent=1) + "\n").encode())
    return trials


def _turns(start: int, n_actions: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Return turns at random, to views that were not shown before where there are such, as one who wants to learn."""
    shown, stands = {start}, start
    turns = []
    for _ in range(n_actions):
        new = [action for action, after in enumerate(SUCCESSORS[stands]) if after not in shown]
        action = int(rng.choice(new or range(len(ACTION_ROTATIONS))))
        stands = SUCCESSORS[stands][action]
        shown.add(stands)
        turns.append(list(ACTION_ROTATIONS)[action])
    return tuple(turns)
