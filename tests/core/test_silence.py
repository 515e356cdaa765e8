import ctypes
import os

import pytest

from atg_fg.core.silence import silenced


@pytest.mark.parametrize("stream", [1, 2])
def test_what_c_code_prints_is_dropped_meanwhile_and_only_then(capfd, stream):
    printf = ctypes.CDLL(None).printf

    def say(text):
        os.write(2, text) if stream == 2 else printf(text)

    say(b"before ")
    with silenced(stream):
        say(b"meanwhile ")
    say(b"after")
    ctypes.CDLL(None).fflush(None)
    assert capfd.readouterr()[stream - 1] == "before after"


def test_a_stream_is_given_back_after_an_error(capfd):
    with pytest.raises(KeyError), silenced(2):
        raise KeyError
    os.write(2, b"heard")
    assert capfd.readouterr().err == "heard"
