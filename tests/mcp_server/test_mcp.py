"""The server of tools by the client of the protocol's SDK, over stdio: one server for all laws; and its parts."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import anyio
import pytest
from mcp import Client
from mcp.client.stdio import StdioServerParameters, stdio_client

from manipcli.core.errors import ExitCode, InvalidInput
from manipcli.judge.verdict import INTERRUPTED
from manipcli.logs.judge_log import judge_log
from manipcli.mcp_server import child, server
from manipcli.mcp_server.child import Runner, bounded, readable
from manipcli.mcp_server.folder import Folder, Outside
from tests.live.sessions import ROOT, SMALL

PACKAGES = (ROOT / "robots", ROOT / "controllers")


def command(folder: Path) -> StdioServerParameters:
    packages = [f"--package-path={path}" for path in PACKAGES]
    words = ["-m", "manipcli", "mcp", f"--folder={folder}", *packages]
    return StdioServerParameters(command=sys.executable, args=words, env={**os.environ, "PYTHONPATH": str(ROOT)})


def confined() -> list[str]:
    """The command lines of commands that are running for this test."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = path.read_bytes().decode().split("\0")
        except OSError:
            continue
        if "manipcli.mcp_server.confined" in words:
            found.append(" ".join(words))
    return found


def test_the_tools_work_in_their_folder_and_nowhere_else(tmp_path: Path) -> None:
    folder, secret = tmp_path / "project", tmp_path / "secret.yaml"
    folder.mkdir()
    secret.write_text("password: 1234\n")
    (folder / "small.yaml").write_text(SMALL)
    (folder / "wrong.yaml").write_text(SMALL.replace("wait", "waitt"))
    (folder / "outside.yaml").write_text(SMALL.replace(str(ROOT / "controllers/arm7_hand3.yaml"), str(secret)))
    (folder / "link.yaml").symlink_to(secret)

    async def use(client: Client) -> None:
        async def call(name: str, **arguments: Any) -> tuple[bool, str]:
            result = await client.call_tool(name, arguments)
            assert len(result.content) == 1
            text: str = getattr(result.content[0], "text", "")
            assert "Traceback" not in text
            return result.is_error or False, text

        tools = {tool.name: tool for tool in (await client.list_tools()).tools}
        assert tools.keys() >= {"check", "plan", "run", "judge", "explain", "live_start", "live_run_step", "live_stop"}
        assert all(tool.description for tool in tools.values())

        error, text = await call("check", files=["wrong.yaml", "outside.yaml"])
        assert error
        assert f"wrong.yaml:{1 + SMALL[: SMALL.index('steps')].count(chr(10))}:" in text
        assert "did you mean 'wait'" in text
        assert "error[USE103]: the file cannot be read: it is outside of the folder of this server" in text
        assert "password" not in text
        error, text = await call("explain", subject="TASK203")
        assert (error, text.partition(":")[0]) == (False, "TASK203")

        for path in ("../secret.yaml", str(secret), "link.yaml", "a\0b", "", "-" * 2000):
            error, text = await call("check", files=[path])
            assert error, path
            assert "1234" not in text
        error, _ = await call("run", task="small.yaml", log="../x")
        assert error
        error, text = await call("judge")
        assert error
        assert "log" in text

        error, text = await call("live_state")
        assert (error, text) == (True, "no session is running; start one with live_start")
        error, text = await call("live_start", task="small.yaml", speed=20)
        assert not error, text
        state = json.loads((await call("live_state"))[1])
        assert abs(state["joints"]["joint_4"] + 1.6) < 0.01
        assert (await call("live_start", task="small.yaml"))[0]
        error, text = await call("live_check_step", step={"wait": "0.1 s"})
        assert (error, json.loads(text)["plannable"]) == (False, True)
        error, text = await call("live_run_step", step={"wait": "0.1 s"})
        assert (error, json.loads(text)["outcome"]) == (False, "done")
        error, text = await call("live_run_step", step={"waitt": "0.1 s"})
        assert error
        assert "did you mean 'wait'" in text
        error, text = await call("live_stop")
        assert "session ended" in text

        async def cancel(scope: anyio.CancelScope) -> None:
            partial = folder / "runs" / "small.mcap.partial"
            while not partial.exists() or partial.stat().st_size < 1_000_000:  # it is simulated
                await asyncio.sleep(0.05)
            scope.cancel()

        async with anyio.create_task_group() as group:
            with anyio.CancelScope() as scope:
                group.start_soon(cancel, scope)
                await call("run", task="small.yaml", overrides=["steps.0.wait=1000 s"])
        assert scope.cancelled_caught
        while any(str(folder) in line for line in confined()):
            await asyncio.sleep(0.05)
        verdict = judge_log(folder / "runs" / "small.mcap")
        assert [each.code for each in verdict.errors] == [INTERRUPTED], verdict
        assert sorted(path.name for path in tmp_path.iterdir()) == ["project", "secret.yaml"]

    async def session() -> None:
        async with asyncio.timeout(120), Client(stdio_client(command(folder))) as client:
            await use(client)

    asyncio.run(session())


@pytest.mark.parametrize("number", [signal.SIGKILL, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_a_session_ends_with_its_server_however_that_ends(number: signal.Signals, tmp_path: Path) -> None:
    (tmp_path / "small.yaml").write_text(SMALL)
    served = command(tmp_path)
    client = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "test", "version": "1"}}
    frames = (
        {"id": 1, "method": "initialize", "params": client},
        {"method": "notifications/initialized"},
        {"id": 2, "method": "tools/call", "params": {"name": "live_start", "arguments": {"task": "small.yaml"}}},
    )
    with subprocess.Popen(
        [served.command, *served.args], env=served.env, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        for frame in frames:
            process.stdin.write(json.dumps({"jsonrpc": "2.0", **frame}) + "\n")
            process.stdin.flush()
            while "id" in frame and json.loads(process.stdout.readline()).get("id") != frame["id"]:
                pass
        assert any(str(tmp_path) in line for line in confined())
        process.send_signal(number)
        code = process.wait(60)
    assert code == (-number if number == signal.SIGKILL else ExitCode.INTERRUPTED)
    while any(str(tmp_path) in line for line in confined()):
        time.sleep(0.05)
    assert judge_log(tmp_path / "runs" / "small@live.mcap").verdict == "passed"


def test_a_folder_resolves_links_and_has_its_logs_below_runs(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "up").symlink_to(tmp_path.parent)
    folder = Folder.of(tmp_path)
    assert folder.file("a/../b.yaml") == "b.yaml"
    assert folder.log("b") == folder.log("runs/b.mcap") == "runs/b.mcap"
    for path in ("up/x", "..", "/", ".", "a/../../x", "\n"):
        with pytest.raises(Outside):
            folder.file(path)
    for path in ("../b", "x/../../b", "runs/../../b"):
        with pytest.raises(Outside):
            folder.log(path)
    (tmp_path / "runs").rmdir()
    (tmp_path / "runs").symlink_to(tmp_path.parent)
    with pytest.raises(Outside, match="symbolic link"):
        folder.log("b")


def test_outputs_are_bounded_and_without_tracebacks(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(child, "MAX_OUTPUT", 10)

    async def of(*parts: bytes) -> str:
        stream = asyncio.StreamReader()
        for part in parts:
            stream.feed_data(part)
        stream.feed_eof()
        return await bounded(stream)

    assert asyncio.run(of(b"0123456789")) == "0123456789"
    assert asyncio.run(of(b"012", b"345678", b"9abc")) == "01234\n... 3 characters are left out ...\n89abc"
    fault = 'some text\nTraceback (most recent call last):\n  File "x"\nValueError: 3'
    assert readable(fault) == "some text\ninternal error: ValueError: 3"
    monkeypatch.setitem(sys.modules, "mcp.server.mcpserver", None)
    with pytest.raises(InvalidInput, match="mcp, which is not installed"):
        server.serve(Runner(Folder.of(tmp_path)))
