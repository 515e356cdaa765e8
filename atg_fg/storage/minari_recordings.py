"""Recordings as datasets of Minari, for offline reinforcement learning, and datasets of Minari as recordings.

A trial is an episode. Its observations are looks as worlds here give them: in each slot the number of a label,
``MISSING`` where nothing was seen; rewards are zero. What offline learners do not ask for is in ``infos``
(``confidence``, ``likelihood``, ``measured``) and in metadata (names).
"""

from __future__ import annotations

import json
import shutil
import warnings
from pathlib import Path
from typing import Any, Final

import numpy as np
from gymnasium import spaces

from atg_fg.core.checks import plain_text
from atg_fg.core.errors import InvalidInputError, needed_by
from atg_fg.core.patterns import MISSING, FloatArray
from atg_fg.core.recordings import RecordedTrial, Recording
from atg_fg.storage.checked_json import parse_json, read_object, without_none
from atg_fg.storage.recordings import RECORDING_FORMAT, RecordingSpec, header_of, recording_of
from atg_fg.worlds.base import looks_space, symbols_of

#: Steps of one dataset, at most.
MAX_STEPS: Final = 1_000_000
#: Name of the metadata that holds the names of slots, actions and labels.
_NAMES: Final = "atg_fg"


def write_minari(recording: Recording, name: str) -> tuple[Path, int]:
    """Write a recording as a new dataset, where Minari keeps them; nothing is left of it if there is an error.

    Returns:
        The folder, and how many trials were left out: Minari has no episode without an action.

    Raises:
        MissingDependencyError: Minari is not installed.
        InvalidInputError: The name is none, or is taken; or no trial has an action.
    """
    minari = _minari()
    from minari.data_collector import EpisodeBuffer
    from minari.storage.datasets_root_dir import get_dataset_path

    folder = Path(get_dataset_path(_checked(name)))
    if folder.exists():
        raise InvalidInputError(f"{name}: there is such a dataset in {folder}; expected another name or version")
    trials = [trial for trial in recording.trials if trial.actions]
    if not trials:
        raise InvalidInputError(f"{recording.place}: no trial with an action; expected one, for an episode has steps")
    episodes = [
        EpisodeBuffer(
            id=number,
            observations=_observations(trial, recording),
            actions=np.array([recording.actions.index(action) for action in trial.actions]),
            rewards=[0.0] * len(trial.actions),
            terminations=[False] * len(trial.actions),
            truncations=[*[False] * (len(trial.actions) - 1), True],
            infos=_infos(trial, recording),
        )
        for number, trial in enumerate(trials)
    ]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of authors and code that are not named
            dataset = minari.create_dataset_from_buffers(
                name,
                episodes,
                observation_space=looks_space(len(recording.slots), len(recording.labels)),
                action_space=spaces.Discrete(len(recording.actions)),
                description=f"Labels in {', '.join(recording.slots)} after each of {', '.join(recording.actions)}.",
            )
        dataset.storage.update_metadata({_NAMES: json.dumps(header_of(recording))})
        dataset.storage.update_episode_metadata(
            [{"trial": each.name, **({} if each.object is None else {"object": each.object})} for each in trials]
        )
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return folder, len(recording.trials) - len(trials)


def read_minari(name: str) -> Recording:
    """Return a dataset as a recording; one that was not written here has numbers for names.

    Raises:
        MissingDependencyError: Minari is not installed.
        InvalidInputError: There is no such dataset here, or its actions or observations are no whole numbers.
    """
    minari = _minari()
    try:
        dataset = minari.load_dataset(_checked(name))
        _check_size(int(dataset.total_steps), name)
        metadata, episodes = dataset.storage.metadata, list(dataset.iterate_episodes())
        about = list(dataset.storage.get_episode_metadata([episode.id for episode in episodes]))
    except FileNotFoundError as error:
        raise InvalidInputError(f"{name}: no such dataset here; expected one that `minari list local` names") from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InvalidInputError(f"{name}: cannot be read: {error}; expected a dataset of Minari") from error
    header = _names(metadata[_NAMES], f"{name}: {_NAMES}") if _NAMES in metadata else _numbers(metadata, name)
    trials = (
        (f"{name}: episode {episode.id}", _trial(episode, data, header, f"{name}: episode {episode.id}"))
        for episode, data in zip(episodes, about, strict=True)
    )
    return recording_of(header, f"{name}: {_NAMES}", trials, name, RecordingSpec())


def _check_size(n_steps: int, name: str) -> None:
    if n_steps > MAX_STEPS:
        raise InvalidInputError(f"{name}: {n_steps} steps; expected at most {MAX_STEPS}")


def _names(text: Any, place: str) -> dict[str, Any]:
    """Return the header that was written with a dataset."""
    header = parse_json(plain_text(text, place), place)
    return read_object(
        header,
        place,
        ("format", "version", "slots", "actions", "labels"),
        ("objects", "aspects", "exclusive", "senses"),
    )


def _numbers(metadata: Any, name: str) -> dict[str, Any]:
    """Return the header of a dataset from elsewhere: its slots, actions and labels go by numbers."""
    seen, actions = metadata["observation_space"], metadata["action_space"]
    symbols = [int(seen.n)] if isinstance(seen, spaces.Discrete) else _symbols(seen)
    if not symbols or not isinstance(actions, spaces.Discrete):
        raise InvalidInputError(f"{name}: {seen} and {actions}; expected whole numbers in slots, and numbered actions")
    return {
        "format": RECORDING_FORMAT,
        "version": 1,
        "slots": [f"slot-{number}" for number in range(len(symbols))],
        "actions": [f"action-{number}" for number in range(int(actions.n))],
        "labels": [str(number) for number in range(max(symbols))],
    }


def _minari() -> Any:
    with needed_by("datasets", "Minari, with its storage,", "minari"):
        import h5py  # noqa: F401 - what Minari stores with
        import minari
    return minari


def _checked(name: str) -> str:
    from minari.dataset.minari_dataset import parse_dataset_id

    try:
        parse_dataset_id(name)
    except (ValueError, TypeError):
        raise InvalidInputError(f"dataset {name!r}; expected a name such as robot/looks-v0") from None
    return name


def _symbols(space: Any) -> list[int]:
    """Return how many symbols each slot has, also where nothing can be missing."""
    if isinstance(space, spaces.MultiDiscrete) and space.nvec.ndim == 1 and not np.any(space.start):
        return [int(size) for size in space.nvec]
    whole = isinstance(space, spaces.Box) and len(space.shape) == 1 and np.issubdtype(space.dtype, np.integer)
    return [int(most) + 1 for most in space.high] if whole and (space.low == 0).all() else symbols_of(space)


def _observations(trial: RecordedTrial, recording: Recording) -> Any:
    number: dict[str | None, int] = {label: index for index, label in enumerate(recording.labels)}
    number[None] = MISSING
    return np.array([[number[label] for label in look.labels] for look in trial.looks], dtype=np.int64)


def _infos(trial: RecordedTrial, recording: Recording) -> dict[str, Any]:
    """Return what offline learners do not ask for, not a number where there is none.

    Confidences have the shape [t + 1, J], likelihoods [t + 1, J, V], readings of senses of the object [t + 1, S].
    """
    shape = (len(trial.looks), len(recording.slots))
    infos = {}
    if any(look.confidences for each in recording.trials for look in each.looks):
        infos["confidence"] = np.full(shape, np.nan)
        for time, look in enumerate(trial.looks):
            if look.confidences:
                infos["confidence"][time] = [np.nan if sure is None else sure for sure in look.confidences]
    if any(look.weights for each in recording.trials for look in each.looks):
        infos["likelihood"] = np.full((*shape, len(recording.labels)), np.nan)
        for time, look in enumerate(trial.looks):
            for slot, weights in enumerate(look.weights):
                if weights is not None:
                    infos["likelihood"][time, slot] = [weights.get(label, 0.0) for label in recording.labels]
    if recording.senses:
        readings = [[dict(look.measured).get(name, np.nan) for name in recording.sense_names] for look in trial.looks]
        infos["measured"] = np.array(readings, dtype=np.float64)
    return infos


def _trial(episode: Any, about: Any, header: Any, place: str) -> dict[str, Any]:
    """Return an episode as JSON lines have a trial."""
    labels = [*header["labels"], None]  # MISSING is the last
    actions = np.asarray(episode.actions).ravel()
    observed = np.asarray(episode.observations).reshape(len(actions) + 1, -1)
    for what, numbers, least, names in (
        ("observations", observed, MISSING, header["labels"]),
        ("actions", actions, 0, header["actions"]),
    ):
        if not np.issubdtype(numbers.dtype, np.integer) or numbers.min() < least or numbers.max() >= len(names):
            raise InvalidInputError(
                f"{place}: {what} from {numbers.min()} to {numbers.max()}; expected {least} to {len(names) - 1}"
            )
    looks: list[list[Any]] = [[labels[symbol] for symbol in symbols] for symbols in observed.tolist()]
    size = (*observed.shape, len(header["labels"]))
    likelihoods = _info(episode, "likelihood", size, place)
    for time, slot in np.ndindex(observed.shape):
        weights = np.array([np.nan]) if likelihoods is None else likelihoods[time, slot]
        if not np.isnan(weights).any():
            looks[time][slot] = dict(zip(header["labels"], weights.tolist(), strict=True))
    stated = _info(episode, "confidence", observed.shape, place)
    names = [each if isinstance(each, str) else each["name"] for each in header.get("senses", [])]
    felt = _info(episode, "measured", (len(observed), len(names)), place) if names else None
    document: dict[str, Any] = {
        "trial": str(about.get("trial", episode.id)),
        "actions": [header["actions"][action] for action in actions.tolist()],
        "looks": looks,
        "object": about.get("object"),
        "confidences": None
        if stated is None
        else [[None if np.isnan(sure) else sure for sure in row] for row in stated.tolist()],
        "measured": None
        if felt is None
        else [{name: value for name, value in zip(names, row, strict=True) if not np.isnan(value)} for row in felt],
    }
    return without_none(document)


def _info(episode: Any, name: str, shape: tuple[int, ...], place: str) -> FloatArray | None:
    """Return what stands beside the looks of an episode."""
    if name not in (episode.infos or {}):
        return None
    found: FloatArray = np.asarray(episode.infos[name])
    if found.shape != shape or not np.issubdtype(found.dtype, np.floating):
        raise InvalidInputError(f"{place}: {name} of shape {found.shape}; expected numbers of shape {shape}")
    return found
