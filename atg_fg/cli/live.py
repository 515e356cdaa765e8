"""``atg-fg live``: a person turns cubes before a camera, and is told what to do next and what it is."""

from __future__ import annotations

import os
import queue
import sys
import webbrowser
from contextlib import ExitStack, closing
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import typer

from atg_fg.cli import options
from atg_fg.cli.lens_options import (
    USUAL_FIELD_OF_VIEW,
    CalibrationFile,
    Dictionary,
    FieldOfView,
    TagsFile,
    TagSize,
    lens_of,
    tags_of,
)
from atg_fg.cli.paths import same_file
from atg_fg.cli.terminal import say
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.core.records import Experiment, TrialRecord, TrialSummary
from atg_fg.core.version import __version__
from atg_fg.learning.structured_memory import memory_for
from atg_fg.policies import make_policy
from atg_fg.storage import plain_files
from atg_fg.storage.memory_files import goes_to_database, has_memory, load_memory, open_memory, save_trial
from atg_fg.worlds.arcube import ACTION_ROTATIONS, ORIENTATIONS

if TYPE_CHECKING:
    from atg_fg.display.live_page import LivePage
    from atg_fg.experiments.live_session import LiveSession
    from atg_fg.senses.video import Frame
    from atg_fg.storage.camera_files import CubeTags

#: Objects that there may be if the file of tags does not say how many cubes there are.
_USUAL_OBJECTS: Final = 20


def live(
    camera: Annotated[int | None, typer.Option(help="Number of a camera, 0 for the first one.")] = None,
    video: Annotated[str | None, typer.Option(help="A video file, or the address of a stream.")] = None,
    images: Annotated[Path | None, typer.Option(help="A folder of images, one look each, by their names.")] = None,
    tags: TagsFile = None,
    dictionary: Dictionary = None,
    tag_size: TagSize = 42.0,
    calibration: CalibrationFile = None,
    field_of_view: FieldOfView = USUAL_FIELD_OF_VIEW,
    pitch: Annotated[
        float | None, typer.Option(help="How far the camera looks down, degrees; found out if not given.")
    ] = None,
    memory: Annotated[
        Path | None,
        options.written(help="Memory file (JSON or .db); made if it is not there. In mind only if not given."),
    ] = None,
    learn: Annotated[
        bool, typer.Option("--learn", help="Learn from every trial, not from those asked for only.")
    ] = False,
    objects: Annotated[
        int | None, typer.Option(min=1, help="Objects that there are, |O|; the cubes in the file of tags if not given.")
    ] = None,
    preset: options.Preset = "default",
    engine: options.PresetsEngine = None,
    policy: options.Policy = "entropy",
    settled: Annotated[
        float, typer.Option(help="No more actions are proposed when the entropy of the verdict is at most this, nats.")
    ] = 0.05,
    ask: Annotated[
        bool | None,
        typer.Option(
            "--ask/--no-ask", help="Ask how the cube was turned where it was not seen; on a terminal if not given."
        ),
    ] = None,
    page: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=65535,
            help="Serve a page on this port; 0 for a free one. Opened by itself where there is a screen.",
        ),
    ] = None,
    draw: Annotated[
        Path | None, options.written(help="Folder for a picture of each look with the tags drawn in.")
    ] = None,
    timeout: Annotated[float, typer.Option(help="Seconds that a frame may take.")] = 10.0,
    seed: options.Seed = 0,
    json_file: options.JsonFile = None,
) -> None:
    """Turn a cube before a camera: be told what to do next and which object it is, and let it be learned.

    A trial begins when a cube stands before the camera and ends when it is taken away. How the cube was turned is read
    from its tags. On the terminal, or on the page: learn, new (another cube), quit, and answers where it is asked.

    Example: atg-fg live --camera 0 --tags cubes.json --memory robot.db --learn
    """
    sources: tuple[tuple[Literal["camera", "video", "images"], Any], ...]
    sources = (("camera", camera), ("video", video), ("images", images))
    given = [(kind, name) for kind, name in sources if name is not None]
    if len(given) != 1:
        raise InvalidInputError(f"live: {len(given)} sources of frames; expected one of --camera, --video and --images")
    # A video may be an address, so that it is no path to the check that all commands share.
    for option, output in (("--json", json_file), ("--memory", memory)):
        if video is not None and output is not None and same_file(Path(output), Path(video)):
            raise InvalidInputError(
                f"{option}: {output} is the file of --video too, and would be overwritten; expected another file"
            )
    if draw is not None:
        plain_files.make_folder(draw)
    known = tags_of(tags, dictionary, tag_size)
    if known is None:
        raise InvalidInputError("live: no tags; expected --tags FILE, as print cube wrote it, or --dictionary NAME")
    from atg_fg.cli.live_teller import LiveTeller
    from atg_fg.experiments.live_session import LiveSession
    from atg_fg.experiments.recognition_agent import RecognitionAgent
    from atg_fg.senses.tags import TagDetector
    from atg_fg.senses.turns import Patience, TurnWatcher
    from atg_fg.senses.video import FrameSource
    from atg_fg.senses.viewpoint import Viewpoint

    kind, name = given[0]
    parameters, chosen = options.model_of(preset, engine, "bayes-filter")
    chosen_policy = make_policy(policy, settled)
    viewpoint = None if pitch is None else Viewpoint.pitched(pitch)
    patience = Patience.of_pictures() if kind == "images" else None
    asks = sys.stdin.isatty() if ask is None else ask
    about = {"source": kind, "tags": str(tags or dictionary), "engine": chosen, "policy": policy, "preset": preset}
    with ExitStack() as stack:
        kept = stack.enter_context(closing(_memory(memory, known, objects)))
        remembered = stack.enter_context(memory_for(parameters, kept))
        remembered.begin_experiment("live", about, seed)

        agent = RecognitionAgent(remembered, parameters, engine=chosen, policy=chosen_policy, seed=seed)

        def begin(frame: Frame) -> LiveSession:
            size = (frame.image.shape[1], frame.image.shape[0])
            detector = TagDetector(known.seen_by(lens_of(calibration, field_of_view, size, frames.place)))
            watcher = TurnWatcher(ACTION_ROTATIONS, viewpoint, patience)
            return LiveSession(detector, watcher, agent, learns=learn, asks=asks)

        def keep(session: LiveSession, record: TrialRecord, learned: str | None) -> None:
            if memory is not None and learned is not None:
                experiment = Experiment("live", about, seed, __version__)
                save_trial(session.memory, memory, TrialSummary.of(record, learned), experiment)

        words: queue.Queue[str] = queue.Queue()
        console = options.console(json_file)
        shown = _page(page, asks, words, stack)
        if shown is not None:
            console.print(f"page: {shown.address}")
        frames = stack.enter_context(FrameSource(kind, name, timeout))
        if asks:
            Thread(target=_read_words, args=(words,), daemon=True).start()
        teller = LiveTeller(begin, console, words, shown, draw, keep)
        teller.run(frames)
        options.write_json({"command": "live", "trials": teller.trials}, json_file)
    if memory is not None and json_file != "-":
        say(f"memory: {memory}, {len(remembered)} objects")


def _memory(path: Path | None, tags: CubeTags, n_objects: int | None) -> RobotMemory:
    """Return the memory in a file, or a new one."""
    n_objects = n_objects or len(tags.cubes) or _USUAL_OBJECTS
    alphabet = PatternAlphabet(("front", "top"), len(tags.ids))
    n_aspects = min(len(ORIENTATIONS), len(alphabet))
    assumptions = Assumptions(n_objects, n_aspects, tuple(ACTION_ROTATIONS), alphabet)
    if path is None:
        return RobotMemory(assumptions)
    if goes_to_database(path):
        return open_memory(path) if has_memory(path) else open_memory(path, assumptions)
    plain_files.check_writable(path)
    return load_memory(path) if os.path.exists(path) else RobotMemory(assumptions)


def _page(port: int | None, asks: bool, words: queue.Queue[str], stack: ExitStack) -> LivePage | None:
    """Return the page, if it is asked for or there is a person at a screen; then it is opened in a browser."""
    has_screen = asks and sys.stdout.isatty() and bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    if port is None and not has_screen:
        return None
    from atg_fg.display.live_page import LivePage

    made = stack.enter_context(LivePage(port or 0, words))
    if has_screen:
        webbrowser.open(made.address)
    return made


def _read_words(words: queue.Queue[str]) -> None:
    """Take in what is typed, line by line; after the last line nobody is there to answer."""
    from atg_fg.cli.live_teller import NOBODY

    for line in sys.stdin:
        words.put(line)
    words.put(NOBODY)
