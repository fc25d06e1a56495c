"""What the robot believes about the poses of the bodies, at every tick of a run.

A body with `known:` is believed to be where it was drawn at the start, until the hand takes it: then it keeps its
believed pose in the link that holds it, and stays where it is let go. `update` replaces the believed pose. What is in
such a body at the start moves with its believed pose while it is truly inside it; once it is out, it is known exactly,
as all other bodies are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, Transform, rotate
from manipcli.model.collision import Carried
from manipcli.model.kinematics import Kinematics
from manipcli.model.state import WorldState
from manipcli.scene.containing import contains, within
from manipcli.scene.scene import Scene
from manipcli.task.believed_scene import contents

CONJUGATE: Final = np.array([-1.0, -1.0, -1.0, 1.0])


@dataclass(slots=True)
class _Own:
    """The belief about a body with `known:`.

    Attributes:
        row: of the body in the arrays of a `WorldState`.
        X_WO: believed pose, with its quaternion.
        covariance: (6, 6) of position [m2] and rotation [rad2] about x, y, z of the world.
        held: the link that carries it, and its believed pose in that link; None while it stays.
        contents: rows of the bodies that were in it at the start.
        centres: (k, 3) [m] of their bounding boxes in O; None: all zero.
    """

    row: int
    X_WO: Transform
    covariance: Array
    contents: npt.NDArray[np.intp]
    centres: Array | None
    held: tuple[str, Transform] | None = None


class Belief:
    """The belief of one run; without uncertain bodies it is the truth, and costs nothing.

    Args:
        scene: the believed scene at the start: its bodies with `known` are uncertain.
        truth: the true scene at the start.
        kinematics: of the robot, as the planner knows it.
        positions: true state -> (n) joint positions as the robot measures them; None: they are the true ones.

    Attributes:
        names: the bodies that may be elsewhere than believed: uncertain ones, and what is in them at the start.
        poses: (k, 7) position and quaternion xyzw of each of `names`, as of the last `look`.
    """

    def __init__(
        self,
        scene: Scene,
        truth: Scene,
        kinematics: Kinematics,
        positions: Callable[[WorldState], Array] | None = None,
    ) -> None:
        self._scene = scene
        self._kinematics = kinematics
        self._positions = positions
        self._row = {body.name: k for k, body in enumerate(scene.movable)}
        uncertain = {body.name: body.known for body in scene.movable if body.known is not None}
        self._own: Mapping[str, _Own] = {
            name: self._about(name, known.covariance, contents(truth, name, uncertain))
            for name, known in uncertain.items()
        }
        rows = sorted({row for own in self._own.values() for row in (own.row, *own.contents)})
        self.names = tuple(scene.movable[row].name for row in rows)
        self._rows = np.array(rows, dtype=np.intp)
        self.poses = np.array([[*X.p, *X.quat_xyzw] for X in (scene.body(name).X_WO for name in self.names)])
        self._state: WorldState | None = None

    def _about(self, name: str, covariance: Array, inside: Sequence[str]) -> _Own:
        scene = self._scene
        centres = np.array([scene.body(each).centre for each in inside])
        rows = np.array([self._row[each] for each in inside], dtype=np.intp)
        return _Own(self._row[name], scene.body(name).X_WO, covariance, rows, centres if centres.any() else None)

    @property
    def uncertain(self) -> tuple[str, ...]:
        """The bodies with `known:`."""
        return tuple(self._own)

    def look(self, state: WorldState) -> WorldState:
        """The state with believed poses; valid until the next call.

        It is `state` itself where everything is known exactly. Velocities of uncertain bodies are the true ones.

        Args:
            state: the true state of one tick, or what this returned for it.
        """
        if not self._own or state is self._state:
            return state
        if self._state is None:
            self._state = WorldState.room(len(state.position), len(self._row))
        found = self._state
        found.numbers[:] = state.numbers
        found.time[...] = state.time
        found.body_linear[:], found.body_angular[:] = state.body_linear, state.body_angular
        for own in self._own.values():
            if own.held is not None:
                link, X_LO = own.held
                own.X_WO = self._link(state, link) @ X_LO
            found.body_position[own.row], found.body_quat_xyzw[own.row] = own.X_WO.p, own.X_WO.quat_xyzw
            if len(own.contents):
                self._carry(own, state, found)
        self.poses[:, :3] = found.body_position[self._rows]
        self.poses[:, 3:] = found.body_quat_xyzw[self._rows]
        return found

    def pose(self, name: str) -> Transform:
        """X_WO of an uncertain body as of the last `look`, `hold`, `let_go` or `update`."""
        return self._own[name].X_WO

    def covariance(self, name: str) -> Array:
        """(6, 6) of the belief about an uncertain body: position [m2] and rotation [rad2] about the axes of the
        world."""
        return self._own[name].covariance

    def hold(self, carried: Carried, state: WorldState) -> None:
        """The hand has closed on an object: it, and uncertain bodies believed inside it, keep their poses in the link.

        Args:
            carried: the object and the link.
            state: as for `look`.
        """
        if not self._own:
            return
        self.let_go(state)
        believed = self.look(state)
        body, k = self._scene.body(carried.body), self._row[carried.body]
        X_WC = Transform.of(xyz=believed.body_position[k], quat_xyzw=believed.body_quat_xyzw[k])
        X_LW = self._link(state, carried.link).inverse()
        for name, own in self._own.items():
            if name == carried.body or contains(body, X_WC, self._scene.body(name), own.X_WO):
                own.held = carried.link, X_LW @ own.X_WO

    def let_go(self, state: WorldState) -> None:
        """The hand has opened: what it held stays where it is believed to be.

        Args:
            state: as for `look`.
        """
        if any(own.held is not None for own in self._own.values()):
            self.look(state)
            for own in self._own.values():
                own.held = None

    def update(self, name: str, X_WO: Transform, covariance: Array) -> None:
        """An uncertain body is at X_WO now, with a covariance (6, 6); see `covariance`. What is in it moves along."""
        own = self._own[name]
        if own.held is not None:
            link, X_LO = own.held
            own.held = link, X_LO @ own.X_WO.inverse() @ X_WO  # as of the last `look`
        own.X_WO, own.covariance = X_WO, covariance

    def _link(self, state: WorldState, link: str) -> Transform:
        """X_WL as measured."""
        return self._kinematics.forward(state.position if self._positions is None else self._positions(state), link)

    def _carry(self, own: _Own, state: WorldState, found: WorldState) -> None:
        """What is truly in an uncertain container keeps its true pose in it."""
        interior = self._scene.movable[own.row].interior
        assert interior is not None  # it has contents
        rows = own.contents
        R_WC, L_CW = _rotation(state.body_quat_xyzw[own.row])
        p, q = state.body_position[rows], state.body_quat_xyzw[rows]
        p_CO = (p - state.body_position[own.row]) @ R_WC
        centres = p_CO if own.centres is None else p_CO + rotate(q, own.centres) @ R_WC
        inside = within(interior, centres)
        if inside.any():
            L_WC = _rotation(own.X_WO.quat_xyzw * CONJUGATE)[1]
            moved = rows[inside]
            found.body_position[moved] = p_CO[inside] @ own.X_WO.R.T + own.X_WO.p
            found.body_quat_xyzw[moved] = q[inside] @ (L_WC @ L_CW).T


def _rotation(quat_xyzw: Array) -> tuple[Array, Array]:
    """The matrix (3, 3) of a unit quaternion q, and the matrix (4, 4) that multiplies by its conjugate from the left.

    As the products of single numbers: this is called at every tick.
    """
    x, y, z, w = quat_xyzw.tolist()
    R = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    L = [[w, z, -y, -x], [-z, w, x, -y], [y, -x, w, -z], [x, y, z, w]]
    return np.array(R), np.array(L)
