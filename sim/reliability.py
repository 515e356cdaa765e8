"""How well the robot turns a cube or a box: many random actions, scored by the simulator's truth."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from atg_fg.core.checks import MANY, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import MISSING, FloatArray
from atg_fg.core.statistics import wilson_interval
from atg_fg.experiments.executors.base import run_pieces
from atg_fg.worlds.arcube import ACTION_SOURCES
from sim.bodies.prepared_robot import PreparedRobot
from sim.manipulation.preparation import prepared
from sim.worlds.domain_randomization import condition_named
from sim.worlds.robonaut_arcube_world import RobonautARcubeWorld
from sim.worlds.robonaut_picture_box_world import RobonautPictureBoxWorld
from sim.worlds.robonaut_world import RobonautWorld
from sim.worlds.stations_world import RobonautTableWorld

#: Actions between two new cubes, as in a trial.
ACTIONS_A_TRIAL: Final = 10
_ACTIONS: Final = tuple(ACTION_SOURCES)


@dataclass(frozen=True)
class Look:
    """What was detected of what could be seen: the symbols of (front, top)."""

    detected: tuple[int, ...]
    shown: tuple[int, ...]

    @property
    def n_detected(self) -> int:
        """How many slots were detected."""
        return sum(symbol != MISSING for symbol in self.detected)

    @property
    def n_wrong(self) -> int:
        """How many slots were detected as another symbol."""
        pairs = zip(self.detected, self.shown, strict=True)
        return sum(symbol not in (MISSING, truth) for symbol, truth in pairs)


@dataclass(frozen=True)
class Fit:
    """Where a box without tags was found at a look, beside where it is, and what it was felt to weigh.

    Attributes:
        position_error: m; ``None`` if it was not found.
        yaw_error: Of its angle about the vertical, degrees; ``None`` if it was not found.
        mass_error: What it was weighed too heavy, kg; ``None`` if it was not weighed.
    """

    position_error: float | None
    yaw_error: float | None
    mass_error: float | None


@dataclass(frozen=True)
class ScoredAction:
    """One action and what came of it, by the simulator's truth (``info`` of ``RobonautWorld.step``)."""

    name: str
    info: dict[str, Any]


@dataclass
class Run:
    """The actions and looks of one trial.

    Attributes:
        actions: The actions, in order.
        looks: The looks at tags of a cube that was not lost.
        fits: The looks at a box without tags that was not lost.
        velocity: Greatest speed of each joint as a share of its limit, shape [2, 7].
        effort: Greatest torque of each joint as a share of its limit, shape [2, 7].
        saturated_steps: Steps in which a torque was cut at its limit.
        self_contacts: Samples in which the robot touched itself.
        steps: Steps of the simulation.
        wall_seconds: How long it took; the only figure that is not the same each time.
    """

    velocity: FloatArray
    effort: FloatArray
    actions: list[ScoredAction] = field(default_factory=list)
    looks: list[Look] = field(default_factory=list)
    fits: list[Fit] = field(default_factory=list)
    saturated_steps: int = 0
    self_contacts: int = 0
    steps: int = 0
    wall_seconds: float = 0.0


def run_actions(
    condition: str,
    n_actions: int,
    seed: int = 0,
    jobs: int = 1,
    urdf: Path | None = None,
    on_trial: Callable[[], None] | None = None,
    n_stations: int = 1,
    pictures: bool = False,
) -> list[Run]:
    """Let the robot do random actions, a new cube every ten, and return what came of them.

    Where there are several cubes, the robot goes to a random one before each action.

    Each trial has its own generator, spawned from ``SeedSequence(seed)``; the result is the same for any ``jobs``.

    Args:
        condition: Name of a condition.
        n_actions: How many; a trial that loses the cube is short, and others take its place.
        seed: Seed of all.
        jobs: Processes.
        urdf: A user's own description of the robot.
        on_trial: Called after each trial.
        n_stations: Cubes in the scene.
        pictures: Whether boxes with pictures are turned, not cubes with tags.
    """
    condition_named(condition)
    for name, number in (("actions", n_actions), ("jobs", jobs), ("stations", n_stations)):
        whole_number(number, name, 1, MANY)
    if pictures and n_stations > 1:
        raise InvalidInputError(f"stations: {n_stations}; expected 1 for boxes with pictures")
    robot = None if urdf is None else prepared(urdf)
    runs: list[Run] = []
    left = n_actions
    spawner = np.random.SeedSequence(seed)
    run_one = partial(_run_trial, condition, robot, n_stations, pictures)
    while left > 0:
        lengths = [ACTIONS_A_TRIAL] * (left // ACTIONS_A_TRIAL)
        lengths += [left % ACTIONS_A_TRIAL] if left % ACTIONS_A_TRIAL else []
        pieces = list(zip(lengths, spawner.spawn(len(lengths)), strict=True))
        done = run_pieces(run_one, pieces, jobs=jobs, on_result=None if on_trial is None else lambda *_: on_trial())
        runs += done
        left -= sum(len(run.actions) for run in done)
    return runs


def _run_trial(
    condition: str,
    robot: PreparedRobot | None,
    n_stations: int,
    pictures: bool,
    piece: tuple[int, np.random.SeedSequence],
) -> Run:
    n_actions, seed = piece
    rng = np.random.default_rng(seed)
    with closing(_world(condition, robot, n_stations, pictures)) as world:
        begun = time.perf_counter()
        observation, info = world.reset(seed=int(rng.integers(2**31)))
        run = Run(world.controller.exertion.velocity, world.controller.exertion.effort)
        _take_account(run, world, observation, info)
        for action in rng.integers(len(_ACTIONS), size=n_actions):
            if n_stations > 1:
                observation, _, _, _, info = world.step(len(_ACTIONS) + rng.integers(n_stations))
                if info["lost"]:
                    break
                _take_account(run, world, observation, info)
            observation, _, _, _, info = world.step(action)
            run.actions.append(ScoredAction(_ACTIONS[action], info))
            if info["lost"]:
                break
            _take_account(run, world, observation, info)
        run.wall_seconds = time.perf_counter() - begun
        exertion = world.controller.exertion
        run.velocity, run.effort, run.saturated_steps = exertion.velocity, exertion.effort, exertion.saturated_steps
        run.self_contacts, run.steps = world.scene.self_contacts, world.scene.steps
    return run


def _take_account(run: Run, world: RobonautWorld, observation: Any, info: dict[str, Any]) -> None:
    """Keep what came of a look."""
    if isinstance(world, RobonautPictureBoxWorld):
        run.fits.append(Fit(**world.errors()))
    else:
        run.looks.append(Look(tuple(observation.tolist()), info["pattern"]))


def _world(condition: str, robot: PreparedRobot | None, n_stations: int, pictures: bool) -> RobonautWorld:
    if pictures:
        return RobonautPictureBoxWorld(condition=condition, urdf=robot)
    if n_stations == 1:
        return RobonautARcubeWorld(condition=condition, urdf=robot)
    return RobonautTableWorld(n_stations=n_stations, condition=condition, urdf=robot)


def summarise(runs: Sequence[Run]) -> dict[str, Any]:
    """Return rates with 95 % Wilson intervals, errors, forces, and times of a list of runs."""
    actions = [action for run in runs for action in run.actions]
    right = [action for action in actions if action.info["right"]]
    steps = sum(run.steps for run in runs)
    return {
        "success": _rate(len(right), len(actions)),
        "by_action": {
            name: _rate(
                sum(action.info["right"] for action in actions if action.name == name),
                sum(action.name == name for action in actions),
            )
            for name in _ACTIONS
        },
        "failures": {
            "stayed": sum(action.info["slipped"] and not action.info["lost"] for action in actions),
            "lost": sum(action.info["lost"] for action in actions),
            "another_orientation": sum(_went_elsewhere(action) for action in actions),
        },
        "angle_error_degrees": _spread(action.info["angle_error"] for action in right),
        "position_error_metres": _spread(action.info["position_error"] for action in right),
        "peak_force_newtons": _spread(action.info["peak_force"] for action in actions),
        "squarings_per_action": float(np.mean([action.info["squarings"] for action in actions])),
        "simulated_seconds_per_action": _spread(action.info["simulated_seconds"] for action in actions),
        **_of_looks([look for run in runs for look in run.looks], [fit for run in runs for fit in run.fits]),
        "joints": {
            "largest_share_of_velocity_limit": float(max(run.velocity.max() for run in runs)),
            "largest_share_of_effort_limit": float(max(run.effort.max() for run in runs)),
            "share_of_steps_at_effort_limit": sum(run.saturated_steps for run in runs) / steps,
            "self_contacts": sum(run.self_contacts for run in runs),
        },
        "timing": {
            "wall_seconds_per_action": sum(run.wall_seconds for run in runs) / len(actions),
            "steps_per_wall_second": steps / sum(run.wall_seconds for run in runs),
        },
    }


def _of_looks(looks: Sequence[Look], fits: Sequence[Fit]) -> dict[str, Any]:
    """Return what was made of looks: at tags, or at boxes without."""
    if not fits:
        return {
            "detection": {
                "both": _rate(sum(look.n_detected == 2 for look in looks), len(looks)),
                "one": _rate(sum(look.n_detected == 1 for look in looks), len(looks)),
                "none": _rate(sum(look.n_detected == 0 for look in looks), len(looks)),
                "wrong_ids": _rate(sum(look.n_wrong > 0 for look in looks), len(looks)),
            }
        }
    off = [fit.mass_error for fit in fits if fit.mass_error is not None]
    return {
        "boxes": {
            "found": _rate(sum(fit.position_error is not None for fit in fits), len(fits)),
            "position_error_metres": _spread(fit.position_error for fit in fits if fit.position_error is not None),
            "yaw_error_degrees": _spread(fit.yaw_error for fit in fits if fit.yaw_error is not None),
            "weighed": len(off),
            "mass_error_kilograms": {"mean": float(np.mean(off)), "deviation": float(np.std(off))} if off else None,
        }
    }


def _went_elsewhere(action: ScoredAction) -> bool:
    info = action.info
    return not info["lost"] and not info["slipped"] and info["orientation"] != info["expected_orientation"]


def _rate(count: int, total: int) -> dict[str, Any]:
    interval = list(wilson_interval(count, total)) if total else None
    return {"count": count, "of": total, "rate": count / total if total else None, "interval95": interval}


def _spread(values: Iterable[float]) -> dict[str, float | None]:
    """Return mean, 95th percentile and maximum."""
    sample = np.array(list(values))
    if not sample.size:
        return {"mean": None, "p95": None, "max": None}
    return {"mean": float(sample.mean()), "p95": float(np.quantile(sample, 0.95)), "max": float(sample.max())}
