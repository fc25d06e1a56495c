"""The controls of one visitor who may command, in his browser alone."""

from __future__ import annotations

import time
from collections.abc import Callable, Coroutine, Mapping
from typing import TYPE_CHECKING, Any, Final, Literal

from manipcli.live.offer import Offer
from manipcli.live.page import service_calls
from manipcli.live.page.controls import Controls
from manipcli.live.page.drive import Drive
from manipcli.live.page.service_calls import (
    EMERGENCY_STOP,
    PAUSE,
    RELEASE,
    STEP,
    STEP_TIME,
    SWITCH,
    service_of,
)
from manipcli.live.page.snapshot import Snapshot
from manipcli.live.play_state import PLAYING
from manipcli.model.robot import RobotModel
from manipcli.replay.view.joint_panel import rows
from manipcli.replay.view.joint_slider import JointSlider, units_of
from manipcli.replay.view.layer_panel import add_layers
from manipcli.replay.view.viser_scene import ViserScene

if TYPE_CHECKING:
    import viser

ROW: Final = 24
"""Characters of the names in one row of buttons."""
_CLEAR: Final = 6.0
"""[s] That a notification is shown."""


class Panel:
    """Controls of one visitor.

    Args:
        client: his browser.
        folder: of the controllers, which all visitors see.
        robot, scene: what is shown.
        offer: of the session; what it does not have gets no control.
        controls: of the visitor.
        period: [s] of the control loop.

    viser's callbacks are coroutines in its own thread: they only hand over. `update` is called in the page's thread.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        folder: viser.GuiFolderHandle,
        robot: RobotModel,
        scene: ViserScene,
        offer: Offer,
        controls: Controls,
        period: float,
    ) -> None:
        self._client, self._offer, self._controls = client, offer, controls
        self._sliders: dict[Drive, list[JointSlider]] = {}
        self._switches: dict[str, viser.GuiCheckboxHandle] = {}
        self._folder = folder
        self._period = period
        self._playing = False
        self._buttons: list[viser.GuiButtonHandle] = []
        self._simulation: viser.GuiButtonGroupHandle | None = None
        gui = client.gui
        self._add_button("EMERGENCY STOP", EMERGENCY_STOP, color="red", order=0.0)
        self._release = self._add_button("Release emergency stop", RELEASE, color=None, order=0.5)
        self._add_simulation(gui)
        self._poses = gui.add_folder("Move to", order=4, visible=bool(controls.poses))
        with self._poses:
            for label, names in controls.poses.items():
                for k, row in enumerate(rows(names, ROW)):
                    group = gui.add_button_group(label if k == 0 else "", row)
                    group.on_click(self._posed(group))
        for drive in controls.drives:
            with gui.add_folder(f"{drive.controller} [{units(robot, drive)}]", order=5):
                self._sliders[drive] = [self._slider(gui, robot, drive, joint) for joint in drive.joints]
        with gui.add_folder("Show", order=8, expand_by_default=False):
            add_layers(gui, scene)
            dark = gui.add_checkbox("dark", False)

            @dark.on_update
            async def _(event: viser.GuiEvent[Any]) -> None:
                gui.configure_theme(dark_mode=dark.value, show_logo=False, show_share_button=False)

    def _add_button(
        self, label: str, service: str, *, color: Literal["red"] | None, order: float
    ) -> viser.GuiButtonHandle | None:
        """Add a button that calls a service without a request; None if the offer does not have it."""
        if service not in self._offer.services:
            return None
        button = self._client.gui.add_button(label, color=color, order=order)
        self._buttons.append(button)

        @button.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            self._controls.put(label, service_calls.call(self._offer, service))

        return button

    def _add_simulation(self, gui: viser.GuiApi) -> None:
        names = [name for name, (kind, _) in service_calls.BUTTONS.items() if service_of(self._offer, kind)]
        if not names:
            return
        group = gui.add_button_group("simulation", names, order=2, hint=f"Step: {STEP_TIME:g} s, then pause")
        self._simulation = group

        @group.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            if group.value == STEP and self._playing:
                self._controls.put(PAUSE, service_calls.press(self._offer, PAUSE, self._period))
            self._controls.put(group.value, service_calls.press(self._offer, group.value, self._period))

    def _posed(self, group: viser.GuiButtonGroupHandle) -> Callable[[Any], Coroutine[Any, Any, None]]:
        async def clicked(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                self._controls.go(group.value)

        return clicked

    def _slider(self, gui: viser.GuiApi, robot: RobotModel, drive: Drive, joint: str) -> JointSlider:
        slider = JointSlider(gui, robot.joint(joint), 0.0)

        async def slid(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:  # not the page itself, which shows where the robot is
                self._controls.slide(drive, joint, slider.value, time.monotonic())

        slider.handle.on_update(slid)
        return slider

    def _switch(self, name: str, active: bool) -> viser.GuiCheckboxHandle:
        with self._folder:
            box = self._client.gui.add_checkbox(name, active, hint="Activate or deactivate this controller.")

        async def switched(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                self._controls.put(name, service_calls.switch(self._offer, name, active=box.value))

        box.on_update(switched)
        return box

    def update(self, snapshot: Snapshot, now: float) -> None:
        """Send what waits, then show the state; `now`: wall time [s]."""
        self._controls.send(snapshot, now)
        self._playing = snapshot.simulation == PLAYING
        if self._release is not None:
            self._release.visible = snapshot.stopped
        over, stopped = bool(snapshot.phase), snapshot.stopped
        with self._client.atomic():
            for button in self._buttons:
                button.disabled = over
            # viser's groups of buttons cannot be disabled.
            if self._simulation is not None:
                self._simulation.visible = not over
            self._poses.visible = bool(self._controls.poses) and not (over or stopped)
            for box in list(self._switches.values()):
                box.disabled = over or (stopped and not box.value)
            for drive, sliders in self._sliders.items():
                obstacle = bool(snapshot.obstacle(drive.controller))
                follows = self._controls.follows(drive, snapshot, now)
                for slider, k in zip(sliders, drive.columns, strict=True):
                    slider.handle.disabled = obstacle or slider.handle.max <= slider.handle.min
                    if follows:
                        slider.follow(float(snapshot.state.position[k]))

    def show_controllers(self, states: Mapping[str, str]) -> None:
        """Set the switches to the states of the controllers."""
        if service_of(self._offer, SWITCH) is None:
            return
        for name, state in states.items():
            if name not in self._switches:
                self._switches[name] = self._switch(name, state == "active")
            self._switches[name].value = state == "active"  # type: ignore[misc]
        for name in self._switches.keys() - states.keys():
            self._switches.pop(name).remove()

    def failed(self, name: str, why: str) -> None:
        """Report that a command was refused."""
        self._controls.refused(name)
        self._client.add_notification(name, why, color="red", auto_close_seconds=_CLEAR)


def units(robot: RobotModel, drive: Drive) -> str:
    """Of the sliders of a drive."""
    return units_of([robot.joint(name) for name in drive.joints])
