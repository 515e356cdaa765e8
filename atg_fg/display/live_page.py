"""A page of a live session: what the camera sees, what is believed, what to do next, and buttons to answer with.

It is served to this machine alone, by the standard library; nothing is loaded from elsewhere.
"""

from __future__ import annotations

import json
import queue
import secrets
from dataclasses import asdict, dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from threading import Lock, Thread
from typing import Final

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.errors import InvalidInputError
from atg_fg.senses.opencv import cv2

_HOST: Final = "127.0.0.1"
_LONGEST_WORD: Final = 64  # bytes


@dataclass(frozen=True)
class PageState:
    """What the page shows beside the picture.

    Attributes:
        say: What to do now, or the verdict.
        seen: The last look.
        belief: Names and probabilities of objects, the most probable first.
        note: What else there is to say.
        words: What can be said by a button.
    """

    say: str = "put a cube before the camera"
    seen: str = ""
    belief: tuple[tuple[str, float], ...] = ()
    note: str = ""
    words: tuple[str, ...] = ()


class LivePage:
    """Serves the page until it is closed; a context manager.

    Args:
        port: Where; 0 for any that is free.
        said: Takes the words of the buttons.

    Raises:
        InvalidInputError: The port is none, or taken.

    Attributes:
        address: To open in a browser.
    """

    def __init__(self, port: int, said: queue.Queue[str]) -> None:
        self._state, self._jpeg, self._number = PageState(), b"", 0
        self._lock, self._token = Lock(), secrets.token_urlsafe(16)
        page = files("atg_fg.display").joinpath("data", "live_page.html").read_text(encoding="utf-8")
        self._page = page.replace("TOKEN", self._token).encode()
        try:
            self._server = ThreadingHTTPServer((_HOST, port), self._handler(said))
        except (OSError, OverflowError) as error:
            raise InvalidInputError(f"page: port {port}: {error}; expected one that is free, 0 for any") from error
        self._server.daemon_threads = True
        self.address = f"http://{_HOST}:{self._server.server_address[1]}/"
        Thread(target=self._server.serve_forever, daemon=True).start()

    def __enter__(self) -> LivePage:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def show(self, state: PageState, picture: NDArray[np.uint8] | None) -> None:
        """Show a state and a picture, RGB."""
        jpeg = b""
        if picture is not None:
            _, coded = cv2.imencode(".jpg", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
            jpeg = coded.tobytes()
        with self._lock:
            self._state, self._jpeg, self._number = state, jpeg, self._number + 1

    def close(self) -> None:
        """Serve no more."""
        self._server.shutdown()
        self._server.server_close()

    def _answer(self, path: str) -> tuple[str, bytes] | None:
        """Return type and content of what is asked for."""
        with self._lock:
            match path.partition("?")[0]:
                case "/":
                    return "text/html; charset=utf-8", self._page
                case "/state":
                    return "application/json", json.dumps({**asdict(self._state), "number": self._number}).encode()
                case "/picture.jpg" if self._jpeg:
                    return "image/jpeg", self._jpeg
        return None

    def _handler(self, said: queue.Queue[str]) -> type[BaseHTTPRequestHandler]:
        live = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                answer = live._answer(self.path) if self._is_local() else None
                if answer is None:
                    self.send_error(404)
                    return
                kind, content = answer
                self.send_response(200)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(content)))
                self.send_header("Cache-Control", "no-store")
                self.end_headers()
                self.wfile.write(content)

            def do_POST(self) -> None:
                # Another site's page can send a request here, but cannot read the token.
                length = self.headers.get("Content-Length", "")
                known = secrets.compare_digest(self.headers.get("X-Token", ""), live._token)
                if not (known and self._is_local() and length.isdecimal() and int(length) <= _LONGEST_WORD):
                    self.send_error(403)
                    return
                said.put(self.rfile.read(int(length)).decode(errors="replace"))
                self.send_response(204)
                self.end_headers()

            def _is_local(self) -> bool:
                """Whether the page was asked for by its own address, and not by a name that someone points here."""
                return self.headers.get("Host", "").partition(":")[0] in (_HOST, "localhost")

            def log_message(self, format: str, *arguments: object) -> None:
                """Print nothing."""

        return Handler
