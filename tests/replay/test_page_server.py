"""The server of `replay`: one page, on 127.0.0.1, for the browser of this machine."""

from __future__ import annotations

import http.client
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from manipcli.cli.app import main
from manipcli.core.errors import InvalidInput
from manipcli.replay.page_server import PageServer, is_meant_for

ROOT = Path(__file__).parents[2]
PAGE = "<!DOCTYPE html><title>a – b</title>"


def _answer(port: int, path: str = "/", headers: dict[str, str] | None = None) -> tuple[int, str]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    try:
        connection.request("GET", path, headers=headers or {})
        response = connection.getresponse()
        return response.status, response.read().decode()
    finally:
        connection.close()


def test_it_answers_with_the_page_and_nothing_else(capfd: pytest.CaptureFixture[str]) -> None:
    with PageServer(PAGE, port=0) as server:
        assert server.url == f"http://127.0.0.1:{server.port}"
        assert _answer(server.port) == (200, PAGE)
        assert _answer(server.port, "/etc/passwd")[0] == 404
        assert _answer(server.port, "/../../etc/passwd")[0] == 404
    assert capfd.readouterr() == ("", "")


def test_requests_of_other_pages_are_refused() -> None:
    with PageServer(PAGE, port=0) as server:
        assert _answer(server.port, headers={"Host": f"localhost:{server.port}"})[0] == 200
        for headers in ({"Host": "evil.example"}, {"Origin": "http://evil.example"}, {"Origin": "null"}):
            status, body = _answer(server.port, headers=headers)
            assert status == 403
            assert PAGE not in body


def test_it_listens_on_this_machine_only_and_closes_its_port() -> None:
    with PageServer(PAGE, port=0) as server:
        assert server._server.server_address[0] == "127.0.0.1"
    with pytest.raises(ConnectionRefusedError):
        _answer(server.port)
    with PageServer(PAGE, port=server.port) as again:
        assert _answer(again.port)[0] == 200


def test_a_port_in_use_is_an_error_and_without_a_port_the_next_one_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = other.getsockname()[1]
        with pytest.raises(InvalidInput, match=f"port {taken} is already in use") as refused:
            PageServer(PAGE, port=taken)
        assert refused.value.findings[0].code == "VIEW001"
        monkeypatch.setattr("manipcli.replay.page_server.DEFAULT_PORT", taken)
        with PageServer(PAGE) as server:
            assert taken < server.port < taken + 100


@pytest.mark.parametrize(
    ("host", "origin", "meant"),
    [
        ("127.0.0.1:80", None, True),
        ("localhost:80", "http://localhost:80", True),
        ("127.0.0.1:80", "http://localhost:80", True),
        (None, None, False),
        ("127.0.0.1", None, False),
        ("127.0.0.1:81", None, False),
        ("127.0.0.1:80", "https://127.0.0.1:80", False),
        ("127.0.0.1:80", "http://127.0.0.1:80.evil.example", False),
    ],
)
def test_who_is_meant(host: str | None, origin: str | None, meant: bool) -> None:
    assert is_meant_for(host, origin, 80) is meant


@pytest.mark.slow
def test_the_command_serves_the_page_that_it_writes_until_it_is_interrupted(tmp_path: Path) -> None:
    log, page = tmp_path / "home.mcap", tmp_path / "home.html"
    task = str(ROOT / "tasks" / "home.yaml")
    assert main(["run", task, "--log", str(log), "--set", "simulation.engine=kinematic", "-q"]) in (0, 1)
    assert main(["replay", str(log), "--html", str(page)]) == 0
    command = [sys.executable, "-m", "manipcli", "replay", str(log), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)\n", process.stdout.readline())
        assert found
        status, body = _answer(int(found[1]))
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0
    assert (status, body) == (200, page.read_text("utf-8"))
