"""A trial in the Rerun viewer: what is seen and believed at each look, beside what a world shows of itself in 3D.

A world that has something to show offers ``show_in(recording)``: from then on it logs its own entities, under
``world``, to the Rerun recording. Entities logged here are ``belief``, ``entropy`` and ``story``; timelines are
``look`` and, where the world sets it, ``time``.
"""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import InvalidInputError, needed_by
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import TrialRecord, TrialStep
from atg_fg.core.visible_text import visible
from atg_fg.display.figures import PALETTE
from atg_fg.storage.plain_files import check_writable, write_bytes_atomically
from atg_fg.worlds.base import World

#: What a world offers that shows itself.
SHOW_IN: Final = "show_in"
#: Where the world is looked at from in the beginning, m: the robot is at the origin and looks along x.
_EYE: Final = (1.75, 1.25, 1.0)
_LOOK_TARGET: Final = (0.2, 0.0, 0.3)
_NAMED: Final = 6  # objects told by name at each look


def import_rerun() -> ModuleType:
    """Return the package ``rerun``.

    Raises:
        MissingDependencyError: It is not installed.
    """
    with needed_by("viewer", "rerun-sdk", "viewer"):
        import rerun
        import rerun.blueprint
    return rerun  # type: ignore[no-any-return]  # whether it has types depends on whether it is installed


class TrialViewer:
    """Logs one trial to a Rerun recording, kept in memory or shown live.

    Args:
        world: Shows itself, too, if it offers ``show_in``.
        memory: That the trial begins with.
        save: File that ``close`` will write; without one, the viewer is opened.

    Attributes:
        recording: Rerun's ``RecordingStream``.

    Raises:
        InvalidInputError: The file cannot be written, or the viewer cannot be opened.
        MissingDependencyError: rerun-sdk is not installed.
    """

    def __init__(self, world: World, memory: RobotMemory, save: Path | None = None) -> None:
        self._rerun = import_rerun()
        if save is not None:
            check_path(save)
        self._save = save
        self._assumptions = memory.assumptions
        self._names = memory.names
        self._look = 0
        self.recording = self._rerun.RecordingStream("atg-fg")
        # When it was run is no part of a trial.
        self.recording.set_log_time_enabled(False)
        self.recording.set_log_tick_enabled(False)
        self._kept = self.recording.memory_recording() if save is not None else None
        if save is None:
            self._open()
        self.recording.send_blueprint(self._layout())
        self._style_lines()
        self.recording.set_time("look", sequence=0)
        if world.has_wrapper_attr(SHOW_IN):
            world.get_wrapper_attr(SHOW_IN)(self.recording)

    def tell(self, step: TrialStep) -> None:
        """Log one look, the belief after it and the action chosen."""
        rerun, recording = self._rerun, self.recording
        recording.set_time("look", sequence=self._look)
        recording.log("belief/bars", rerun.BarChart(step.belief.probabilities))
        recording.log("belief/names", rerun.TextDocument(self._told(step.belief), media_type="text/markdown"))
        recording.log("belief/unseen", rerun.Scalars(step.belief.unseen))
        recording.log("entropy/now", rerun.Scalars(step.belief.entropy))
        if step.expected_entropies is not None:
            for action, value in zip(self._assumptions.actions, step.expected_entropies.tolist(), strict=True):
                recording.log(f"entropy/expected/{action}", rerun.Scalars(value))
        seen = ", ".join(
            f"{slot} {'not seen' if symbol is None else symbol}"
            for slot, symbol in zip(self._assumptions.alphabet.slots, step.detection, strict=True)
        )
        chosen = "" if step.action is None else f"; next: {self._assumptions.actions[step.action]}"
        recording.log("story", rerun.TextLog(f"look {self._look}: {seen}{chosen}"))
        self._look += 1

    def verdict(self, record: TrialRecord) -> None:
        """Log how the trial ended."""
        told = f"{record.verdict}{'' if record.matched is None else f': {record.matched}'}"
        self.recording.log("story", self._rerun.TextLog(f"verdict: {told}", level="INFO"))

    def close(self) -> None:
        """Write the file, whole or not at all, or see that the viewer has got everything.

        Raises:
            InvalidInputError: The file cannot be written.
        """
        if self._save is not None and self._kept is not None:
            write_bytes_atomically(self._save, self._kept.drain_as_bytes())
        else:
            self.recording.flush()

    def _open(self) -> None:
        try:
            self.recording.spawn()
        except (RuntimeError, OSError) as error:
            raise InvalidInputError(
                f"viewer: cannot be opened: {error}; expected a screen, or --save FILE.rrd"
            ) from error

    def _style_lines(self) -> None:
        """Give the entropy and the expectations of each action the colours that they have in all figures."""
        lines: dict[str, tuple[str, tuple[int, ...], float]] = {"entropy/now": ("now", (200, 200, 200), 3.0)}
        for number, action in enumerate(self._assumptions.actions):
            colour = PALETTE[number % len(PALETTE)].removeprefix("#")
            lines[f"entropy/expected/{action}"] = (f"expected after {action}", tuple(bytes.fromhex(colour)), 1.5)
        for entity, (name, rgb, width) in lines.items():
            style = self._rerun.SeriesLines(names=[name], colors=[rgb], widths=[width])
            self.recording.log(entity, style, static=True)

    def _told(self, belief: IdentityBelief) -> str:
        """Return the most probable objects as a table in Markdown, with the bar that each has in the chart."""
        order = belief.objects.argsort(kind="stable")[::-1][:_NAMED]
        rows = [(index, self._names[index], float(belief.objects[index])) for index in order.tolist()]
        rows.append((len(self._names), "unseen", belief.unseen))
        lines = [f"| {bar} | {_as_markdown(name)} | {share:.1%} |" for bar, name, share in rows]
        return "\n".join(["| bar | object | probability |", "|---|---|---|", *lines])

    def _layout(self) -> Any:
        """Return how the viewer is laid out: the world on the left, belief and entropy on the right."""
        views = self._rerun.blueprint
        eye = views.EyeControls3D(position=_EYE, look_target=_LOOK_TARGET)
        return views.Blueprint(
            views.Horizontal(
                views.Vertical(
                    views.Spatial3DView(origin="world", name="world", eye_controls=eye),
                    views.TextLogView(origin="story", name="story"),
                    row_shares=[4, 1],
                ),
                views.Vertical(
                    views.Spatial2DView(origin="world/camera", name="what the camera sees"),
                    views.BarChartView(origin="belief/bars", name="belief: remembered objects, then unseen"),
                    views.TextDocumentView(origin="belief/names", name="most probable"),
                    views.TimeSeriesView(origin="entropy", name="entropy of identity, nats"),
                    row_shares=[3, 2, 2, 3],
                ),
                column_shares=[3, 2],
            ),
            views.TimePanel(timeline="look"),
            collapse_panels=True,
        )


def _as_markdown(name: str) -> str:
    """Return a name that Markdown shows as it is, in a cell of a table."""
    return re.sub(r"([\\`*_{}\[\]<>()#+!|~&])", r"\\\1", visible(name))


def check_path(path: Path) -> None:
    """Refuse, before any work is done, a path that a recording cannot be saved to.

    Raises:
        InvalidInputError: Another suffix than .rrd, or a place that cannot be written.
    """
    if path.suffix.lower() != ".rrd":
        raise InvalidInputError(f"recording {str(path)!r}: suffix {path.suffix!r}; expected .rrd")
    check_writable(path)
