"""The page of a live session in the browser: what the robot does, and for visitors with the token, its controls.

An outlet of the process of the network. A thread of its own copies the newest state to the browsers, at most 20 times
per second of wall time and in at most a tenth of it; while no browser is connected it wants no states.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import partial
from queue import SimpleQueue
from typing import TYPE_CHECKING, Final

from manipcli.live.access import Access, query
from manipcli.live.command import Answer
from manipcli.live.outlet import Network, Outlet
from manipcli.live.page import service_calls, texts
from manipcli.live.page.controls import Controls
from manipcli.live.page.door import MAY_COMMAND, door
from manipcli.live.page.drive import drives_of
from manipcli.live.page.panel import Panel
from manipcli.live.page.reader import Reader
from manipcli.live.page.snapshot import ENDED, Snapshot
from manipcli.live.page.story import TOPICS, Story
from manipcli.model.configuration import configuration
from manipcli.model.state import WorldState
from manipcli.render.drawing import draw, floors_of
from manipcli.render.placing import Placing
from manipcli.replay.view.viser_scene import ViserScene
from manipcli.replay.view.viser_server import LocalServer

if TYPE_CHECKING:
    import viser

PERIOD: Final = 0.05
"""[s] Of wall time between two updates."""
SHARE: Final = 9.0
"""Pause after an update, in its own duration."""
ASKING: Final = 0.5
"""[s] Between two questions for the states of controllers and simulation, and two texts."""
IDLE: Final = 0.2
"""[s] Between two looks for visitors."""
PARTING: Final = 0.2
"""[s] That the last texts have to reach the browsers."""


class LivePage(LocalServer, Outlet):
    """A served page: an outlet.

    Args:
        network: of the session; what its offer does not have gets no control.
        token: that commands need; None: they need none.
        port: of 127.0.0.1, see `LocalServer`.

    Attributes:
        notice: see `Outlet`.

    Raises:
        InvalidInput: VIEW001 the port cannot be used.
    """

    def __init__(self, network: Network, *, token: str | None, port: int | None) -> None:
        robot, scene = network.publisher.robot, network.publisher.scene
        super().__init__(network.title or robot.name, port=port, option="--page-port", check=door(Access(token)))
        self.notice = f"page: {self.url}{query(token)}"
        self._network, self._offer, self._robot = network, network.publisher.offer, robot
        self._drives = drives_of(robot, network.publisher.recorded, self._offer)
        self._placing = Placing(robot, scene)
        self._story = Story()
        self._visitors: dict[int, Panel | Reader] = {}
        self._answers: SimpleQueue[tuple[int | None, str, Answer]] = SimpleQueue()
        self._controllers: dict[str, str] = {}
        self._simulation: int | None = None
        self._newest: Snapshot | None = None
        self._asks = self._watched = False
        self._clock: deque[tuple[float, float]] = deque(maxlen=5)
        self._shown: Snapshot | None = None
        self._asked = self._timed = 0.0
        self._over = threading.Event()
        drawing = draw(robot, scene)
        self._notes = drawing.missing
        try:
            start = self._placing.start(configuration(robot))
            self._scene = ViserScene(self.viser, drawing, start, floors=floors_of(scene))
        except BaseException:
            self.stop()
            raise
        gui = self.viser.gui
        self._status = gui.add_html(texts.status(None, None), order=1)
        self._steps_folder = gui.add_folder("Steps", order=3, visible=False)
        with self._steps_folder:
            self._steps = gui.add_html("")
        self._controllers_folder = gui.add_folder("Controllers", order=6)
        with gui.add_folder("Messages", order=7):
            self._messages = gui.add_html("")
        self.viser.on_client_connect(self._came)
        self.viser.on_client_disconnect(self._left)
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)
        self._thread.start()

    def wanted(self) -> Collection[str]:
        return TOPICS

    def message(self, topic: str, ns: int, data: bytes) -> None:
        self._story.hear(topic, data)

    def watches(self) -> bool:
        return self._watched

    def state(self, tick: int, state: WorldState) -> None:
        if self._asks:
            publisher = self._network.publisher
            self._newest, self._asks = Snapshot.of(tick * publisher.period, state, publisher.outputs), False

    def close(self) -> None:
        self._over.set()
        self._thread.join(timeout=2.0)
        try:
            self._part()
        finally:
            self.stop()

    def _part(self) -> None:
        """Show the end of the session, which browsers keep on their screens."""
        clients = self.viser.get_clients().values()
        if not clients or self._thread.is_alive():
            return
        self._story.read()
        if self._story.phase != ENDED:  # the simulation failed
            self._story.phase = ENDED
            self._story.changed = 0.0 if self._newest is None else self._newest.time
        self._update(time.monotonic(), news=True)
        self.viser.flush()
        for client in clients:
            client.flush()
        time.sleep(PARTING)

    async def _came(self, client: viser.ClientHandle) -> None:
        if not MAY_COMMAND.get():
            self._visitors[client.client_id] = Reader(client, self._controllers_folder, self._controllers)
            return
        answered = partial(self._answered, client.client_id)
        controls = Controls(self._robot, self._drives, self._offer, self._network.put, answered)
        period = self._network.publisher.period
        self._visitors[client.client_id] = Panel(
            client, self._controllers_folder, self._robot, self._scene, self._offer, controls, period
        )

    async def _left(self, client: viser.ClientHandle) -> None:
        self._visitors.pop(client.client_id, None)

    def _answered(self, number: int | None, name: str, answer: Answer) -> None:
        self._answers.put((number, name, answer))

    def _run(self) -> None:
        pause = IDLE
        while not self._over.wait(pause):
            began = time.monotonic()
            try:
                self._look(began)
            except Exception as error:  # noqa: BLE001 (shown; a thread that ends would freeze the page)
                self._messages.content = texts.fault(error)
            pause = max(PERIOD, SHARE * (time.monotonic() - began)) if self._watched else IDLE

    def _look(self, now: float) -> None:
        """Update the page, if a browser is connected."""
        news = self._story.read()
        watched = bool(self.viser.get_clients())
        if watched != self._watched:
            self._watched = watched
            self._network.changed()
        if watched:
            self._update(now, news)

    def _update(self, now: float, news: bool) -> None:
        """Show what is new, and send what visitors ask."""
        self._take_answers()
        newest = self._newest
        self._asks = True
        if now - self._asked >= ASKING:
            self._asked = now
            self._ask()
        if newest is None:
            return
        story = self._story
        snapshot = replace(
            newest,
            time=story.changed if story.phase else newest.time,
            controllers=self._controllers,
            simulation=self._simulation,
            stopped=story.stopped,
            phase=story.phase,
        )
        if newest is not self._shown:
            self._shown = newest
            state = newest.state
            self._scene.place(self._placing.at(state.position, state.body_position, state.body_quat_xyzw))
        for visitor in list(self._visitors.values()):
            visitor.update(snapshot, now)
        if news or not self._messages.content:
            self._show_events()
        due = now - self._timed >= ASKING
        if due:
            self._timed = now
            self._clock.append((now, snapshot.time))
        if due or news:
            self._status.content = texts.status(snapshot, self._factor(), self._notes)

    def _ask(self) -> None:
        """Ask for the states of controllers and simulation."""
        if self._story.phase:
            return
        for kind in (service_calls.LIST, service_calls.GET_STATE):
            service = service_calls.service_of(self._offer, kind)
            if service is not None and service in self._offer.readers:
                self._network.put(service_calls.call(self._offer, service, answer=partial(self._answered, None, kind)))

    def _factor(self) -> float | None:
        """Simulated seconds per second of wall time, over the last two seconds."""
        (before, first), (now, last) = self._clock[0], self._clock[-1]
        return (last - first) / (now - before) if now > before and last >= first else None

    def _show_events(self) -> None:
        story = self._story
        self._messages.content = texts.messages(story.messages)
        self._steps.content = texts.steps(story.steps)
        self._steps_folder.visible = bool(story.steps)

    def _take_answers(self) -> None:
        while not self._answers.empty():
            number, name, answer = self._answers.get()
            if number is None:
                self._states_of(answer.values)
                continue
            self._asked = 0.0  # it can have changed what is asked for
            why = service_calls.failure(answer)
            visitor = self._visitors.get(number)
            if why is not None and visitor is not None:
                visitor.failed(name, why)

    def _states_of(self, values: Mapping[str, object]) -> None:
        """Keep the states of controllers, or of the simulation."""
        match values:
            case {"controller": list(found)}:
                self._controllers = {each["name"]: each["state"] for each in found}
                for visitor in list(self._visitors.values()):
                    visitor.show_controllers(self._controllers)
            case {"state": {"state": int(state)}}:
                self._simulation = state
