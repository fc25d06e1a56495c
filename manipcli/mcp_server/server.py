"""Server of the Model Context Protocol over stdio: the tools of a folder, for clients with a language model."""

from __future__ import annotations

import asyncio
import functools
import logging
import os
import shutil
import signal
from collections.abc import Awaitable, Callable
from dataclasses import replace
from tempfile import TemporaryDirectory
from typing import Any, Final

from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput
from manipcli.core.version import __version__
from manipcli.mcp_server.child import Runner
from manipcli.mcp_server.live_tools import LiveTools
from manipcli.mcp_server.tools import Failed, Tools

INSTRUCTIONS: Final = (
    "manipcli runs manipulation tasks for robot arms, written as YAML files: a task names a robot, its controllers, a "
    "scene, steps and expectations. Edit the files, `check` them until nothing is found, then `run`. Findings have a "
    "code and a place (file:line:column); `explain` a code for its meaning. All paths are relative to the folder of "
    "this server; logs are written to runs/."
)


def serve(runner: Runner) -> None:
    """Serve until the client closes stdin; a signal ends the process.

    Raises:
        InvalidInput: USE151 the library is not installed.
    """
    library = _library()
    logging.getLogger("mcp").setLevel(logging.CRITICAL)  # what a model got wrong is its own answer
    server = library.MCPServer("manipcli", version=__version__, instructions=INSTRUCTIONS, log_level="CRITICAL")
    # Others may have files in the usual folder; a command that is ending may still write to this one.
    with TemporaryDirectory(prefix="manipcli-mcp-", ignore_cleanup_errors=True) as name:
        runner = replace(runner, environment={**runner.environment, "TMPDIR": name})
        live = LiveTools(runner)
        for tool in (*Tools(runner).all, *live.all):
            server.add_tool(_answering(tool), structured_output=False)
        asyncio.run(_run(server, live, lambda: shutil.rmtree(name, ignore_errors=True)))


async def _run(server: Any, live: LiveTools, clean: Callable[[], None]) -> None:
    """Serve; the session ends first. Commands that run at a signal end by themselves, see `confined`."""
    signaled = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        asyncio.get_running_loop().add_signal_handler(number, signaled.set)
    serving = asyncio.create_task(server.run_stdio_async())
    waiting = asyncio.create_task(signaled.wait())
    await asyncio.wait((serving, waiting), return_when=asyncio.FIRST_COMPLETED)
    await live.close()
    if signaled.is_set():
        clean()
        os._exit(ExitCode.INTERRUPTED)  # the thread that reads stdin cannot be ended
    serving.result()


def _answering(tool: Callable[..., Awaitable[Any]]) -> Callable[..., Awaitable[Any]]:
    """The tool, with its failures as errors of the protocol that the model reads."""
    from mcp.types import CallToolResult, TextContent

    @functools.wraps(tool)
    async def answering(*arguments: Any, **named: Any) -> Any:
        try:
            return await tool(*arguments, **named)
        except Failed as error:
            return CallToolResult(content=[TextContent(type="text", text=str(error))], is_error=True)

    return answering


def _library() -> Any:
    try:
        import mcp.server.mcpserver
    except ImportError as error:
        message = "`manipcli mcp` needs the library mcp, which is not installed"
        raise InvalidInput([Diagnostic("USE151", message, hint='pip install "manipcli[mcp]"')]) from error
    return mcp.server.mcpserver
