"""However a program ends, it ends, and its leases are given back."""

import os
import signal
import subprocess
import sys
import time

import pytest

from support.cell_peer import Peer

BEGIN = """
import os, sys, threading, time
from axisync_client import Client
client = Client(sys.argv[1])
lease = client.lease("kingkong", ttl_s=30.0)
events, states = client.events(), client.states()
print("ready", flush=True)
"""
ENDINGS = {
    "falls off the end": ("", 0),
    "raises": ("raise ValueError", 1),
    "sys.exit": ("sys.exit(3)", 3),
    "in a thread's error": ("t = threading.Thread(target=lambda: next(iter([]), None)); t.start(); t.join()", 0),
    "closed by hand": ("client.close()", 0),
    "inside of with": ("with lease: raise SystemExit(4)", 4),
}


AWAITED = """
import asyncio, os, signal, sys, time
from axisync_client import AsyncClient
async def main():
    client = await AsyncClient(sys.argv[1])
    lease = await client.lease("kingkong", ttl_s=30.0)
    events, states = client.events(), client.states()
    waiting = asyncio.create_task(anext(events))
    await asyncio.sleep(0.1)
    print("ready", flush=True)
    %s
asyncio.run(main())
"""
AWAITED_ENDINGS = {
    "falls off the end": ("pass", 0),
    "raises": ("raise ValueError", 1),
    "sys.exit": ("sys.exit(3)", 3),
    "in a task": ("async with lease: await asyncio.create_task(asyncio.to_thread(sys.exit, 4))", 4),
    "an abandoned question": ("asyncio.create_task(client.state()); await asyncio.sleep(0)", 0),
    "closed by hand": ("await client.close()", 0),
}


def start(peer: Peer, program: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-c", program, peer.endpoint],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )


def ready(program: "subprocess.Popen[str]") -> None:
    assert program.stdout is not None
    assert program.stdout.readline() == "ready\n"


@pytest.mark.parametrize("name", ENDINGS)
def test_a_program_ends(peer: Peer, name: str) -> None:
    code, status = ENDINGS[name]
    program = start(peer, BEGIN + code)
    ready(program)
    _, errors = program.communicate(timeout=20)
    assert program.returncode == status, errors
    assert "FATAL" not in errors
    assert "panicked" not in errors
    assert not peer.leases


@pytest.mark.parametrize("name", AWAITED_ENDINGS)
def test_a_program_of_asyncio_ends(peer: Peer, name: str) -> None:
    code, status = AWAITED_ENDINGS[name]
    program = start(peer, AWAITED % code)
    ready(program)
    _, errors = program.communicate(timeout=20)
    assert program.returncode == status, errors
    assert "FATAL" not in errors
    assert "panicked" not in errors
    assert not peer.leases


def test_ctrl_c_ends_a_program_of_asyncio(peer: Peer) -> None:
    program = start(peer, AWAITED % "async with lease: await waiting")
    ready(program)
    time.sleep(0.2)
    program.send_signal(signal.SIGINT)
    _, errors = program.communicate(timeout=20)
    assert "KeyboardInterrupt" in errors
    assert not peer.leases


def test_ctrl_c_ends_a_program_that_reads_a_stream(peer: Peer) -> None:
    program = start(peer, BEGIN + "next(events)")
    ready(program)
    time.sleep(0.2)
    program.send_signal(signal.SIGINT)
    _, errors = program.communicate(timeout=20)
    assert "KeyboardInterrupt" in errors
    assert not peer.leases


def test_ctrl_c_ends_a_program_that_waits_for_an_answer(peer: Peer) -> None:
    peer.deaf["state"] = 99
    program = start(peer, BEGIN + "client.timeout_s = 60.0; print('asking', flush=True); client.state()")
    ready(program)
    assert program.stdout is not None
    assert program.stdout.readline() == "asking\n"
    time.sleep(0.2)
    program.send_signal(signal.SIGINT)
    _, errors = program.communicate(timeout=20)
    assert "KeyboardInterrupt" in errors
