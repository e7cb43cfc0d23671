"""The guest's console: output between the marks and the exit code, however the bytes are cut."""

from collections.abc import Callable
from types import ModuleType

import pytest

Load = Callable[[str], ModuleType]
STREAM = b"boot\r\n\x1eAXISYNC-UML-BEGIN\nout \x1e put\n\x1eAXISYNC-UML-END 7\nreboot: System halted\n"


@pytest.mark.parametrize("size", [1, 2, 7, len(STREAM)])
def test_output_and_exit_code_in_any_pieces(load: Load, size: int) -> None:
    console = load("uml/console.py").Console()
    output = b"".join(console.feed(STREAM[i : i + size]) for i in range(0, len(STREAM), size))
    assert output == b"out \x1e put\n"
    assert console.exit_code == 7


def test_output_is_handed_on_before_the_end(load: Load) -> None:
    console = load("uml/console.py").Console()
    assert console.feed(b"\x1eAXISYNC-UML-BEGIN\nfirst line") == b"first line"
    assert console.exit_code is None


def test_a_guest_that_does_not_get_to_the_command_shows_what_it_said(load: Load) -> None:
    console = load("uml/console.py").Console()
    assert console.feed(b"insmod: no such file\n") == b""
    assert not console.begun
    assert "insmod: no such file" in console.unread()


def test_init_quotes_the_command_and_keeps_the_host_session_out(load: Load) -> None:
    script = load("uml/guest.py").script(
        ["echo", "a b", "$HOME;'"],
        cwd="/some where",
        environment={"PATH": "/opt/bin", "TMPDIR": "/host", "GREETING": "it's", "BASH_FUNC_x%%": "() { :; }"},
        modules="/usr/lib/uml/modules/6.1/kernel",
        vcan="/repo/deploy/vcan.sh",
    )
    assert """echo 'a b' '$HOME;'"'"'' </dev/null""" in script
    assert "cd '/some where' || exit 1" in script
    assert "export PATH=/opt/bin:/usr/local/sbin" in script
    assert """export GREETING='it'"'"'s'""" in script
    assert "/host" not in script
    assert "BASH_FUNC" not in script
