"""Fit of a body to a depth picture: it is rendered at a pose and compared pixel by pixel.

A pose is a state (4,): translation [m] from the believed pose in the axes of the world, and rotation about the world's
z axis through the origin of the body [rad]. The depth of the surface with the normal n changes along the ray d by
n . v / (n . d) where the body moves by v, so that Gauss-Newton steps are those of point-to-plane registration whose
correspondences are the pixels: what the body hides of itself has none, and the noise is that of the sensor. Outlines
are compared too, since depth alone does not place a plane seen from the front.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array, Transform, matrix_from_axis_angle
from manipcli.perception.picture import Mask, Picture, patches
from manipcli.render.raster import Raster
from manipcli.render.surface import Surface
from manipcli.render.triangles import Indices

LATERAL = 0.5
"""Standard deviation of the place in the picture where depth is measured [pixel]."""
BLUR = 1.5
"""Standard deviation of the blur of edges [pixel]."""
EDGE = 0.7
"""Standard deviation of the place of an edge [pixel], at each of its pixels."""
GATE = 4.0
"""Standard deviations of depth within which a pixel is explained."""
LONGEST, WIDEST = 0.03, 0.25
"""Largest step: translation [m] and rotation [rad]."""
JUMP = 0.01
"""Depth by which a pixel is off, beyond its noise, that is as wrong as any more [m]."""
HELD, HELD_ROTATION = 2e-3, 0.05
"""Standard deviations of a step [m] and [rad] where the picture contains no information."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """How a pose explains a picture, in pixels.

    Attributes:
        explained: show the body at its depth.
        missing: should show it, and show something behind it.
        covered: should show it, and show something unexpected in front of it, in the volume.
        beside: show something unexpected in the volume where the body is not.
        against: missing, covered and beside pixels in patches, more than the single ones along edges.
        cost: truncated sum of squared depth errors, in standard deviations.
        residual: root mean square of the depth errors of explained pixels [m].
        spread: the same in standard deviations.
    """

    explained: int
    missing: int
    covered: int
    beside: int
    against: int
    cost: float
    residual: float
    spread: float

    @property
    def inliers(self) -> float:
        """Share of the pixels that should show the body and do."""
        return self.explained / max(self.explained + self.missing + self.covered, 1)


@dataclass(frozen=True, slots=True)
class _Rendered:
    """`depth` (h, w) [m]; `shown` where it differs from what was expected; `at` flat indices of the pixels that are
    shown, and of these `change` (n, 4) of depth with the state, and `sigma` (n) [m] of depth."""

    depth: Array
    shown: Mask
    at: Indices
    change: Array
    sigma: Array


class Fit:
    """The fit of one body to one picture.

    Args:
        picture: what was measured.
        shown: the surface of the body in O.
        X_WO: believed pose.
        reach: (4,) the state is at most this before; 0: known. Rotations stay within it, pi: any.
    """

    def __init__(self, picture: Picture, shown: Surface, X_WO: Transform, reach: Array) -> None:
        self._picture = picture
        self._raster = Raster([shown], picture.lens)
        a, b, c = (shown.vertices[shown.faces[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        self._normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        self._X_WO, self._R_CW = X_WO, picture.X_WC.R.T
        self._rays = picture.rays.reshape(-1, 3)
        self.free = np.flatnonzero(reach > 0.0)
        self._weight = np.diag(3.0 / np.square(reach[self.free]))  # of uniform distributions
        self._rotation = float(reach[3]) if reach[3] < math.pi else math.inf
        self._seen = np.isfinite(picture.depth)
        self._radius = float(np.linalg.norm(shown.vertices, axis=1).max())

    def pose(self, state: Array) -> Transform:
        """X_WO of a state."""
        R = matrix_from_axis_angle((0.0, 0.0, 1.0), float(state[3])) @ self._X_WO.R
        return Transform.of(xyz=self._X_WO.p + state[:3], R=R)

    def _see(self, state: Array) -> tuple[Array, Indices, Transform]:
        """Depth and faces at a state (overwritten by the next call), and its pose."""
        X = self.pose(state)
        R, p = self._R_CW @ X.R, self._R_CW @ (X.p - self._picture.X_WC.p)
        seen = self._raster.see(R[None], p[None], np.array([0.0, 0.0, -1.0]))
        return seen.depth, seen.face, X

    def _render(self, state: Array) -> _Rendered:
        picture = self._picture
        depth, face, X = self._see(state)
        shown = depth < picture.floor
        at = np.flatnonzero(shown).astype(np.int64)
        z, d = depth.reshape(-1)[at], self._rays[at]
        n_W = self._normals[face.reshape(-1)[at]] @ X.R.T
        n_C = n_W @ picture.X_WC.R
        across = np.einsum("ij,ij->i", n_C, d)
        across = np.where(np.abs(across) > 1e-6, across, 1e-6)
        r = (d * z[:, None]) @ picture.X_WC.R.T + (picture.X_WC.p - X.p)
        turned = n_W[:, 1] * r[:, 0] - n_W[:, 0] * r[:, 1]
        change = np.column_stack([n_W, turned]) / across[:, None]
        slope = np.hypot(*((n_C[:, :2] * picture.pixel).T * (z / across)))
        sigma = np.hypot(picture.noise.reshape(-1)[at], LATERAL * slope)
        return _Rendered(depth.copy(), shown, at, change, sigma)

    def shifted(self, state: Array, shown: Mask) -> Array:
        """The state moved so that the middle of what it shows is the middle of the measured points at `shown`."""
        picture = self._picture
        depth, _, _ = self._see(state)
        visible = depth < picture.floor
        if not visible.any() or not shown.any():
            return state
        measured, rendered = (
            (self._rays[mask.reshape(-1)] * z[mask][:, None]).mean(axis=0)
            for mask, z in ((shown, picture.depth), (visible, depth))
        )
        found = state.copy()
        move = np.append(picture.X_WC.R @ (measured - rendered), 0.0)
        found[self.free] += move[self.free]
        return found

    def refined(self, state: Array, gate: float, *, edges: bool = False) -> tuple[Array, Array]:
        """One Gauss-Newton step, and the information matrix (free, free) of the state before it.

        Args:
            state: (4,).
            gate: most depth error of a pixel that counts [m]; GATE standard deviations always count.
            edges: use the edges too.
        """
        picture, rendered = self._picture, self._render(state)
        error = picture.depth.reshape(-1)[rendered.at] - rendered.depth.reshape(-1)[rendered.at]
        with np.errstate(invalid="ignore"):
            used = np.abs(error) < np.maximum(gate, GATE * rendered.sigma)
            # Near the floor the measured pixels are those with noise towards the camera: they would pull.
            noise = picture.noise.reshape(-1)[rendered.at]
            used &= picture.shown.reshape(-1)[rendered.at]
            used &= rendered.depth.reshape(-1)[rendered.at] < picture.floor.reshape(-1)[rendered.at] - 3 * noise
        J = (rendered.change[used] / rendered.sigma[used, None])[:, self.free]
        H, g = _normal_equations(J, error[used] / rendered.sigma[used])
        if edges and len(self.free):
            more_H, more_g = self._edges(state, rendered)
            H, g = H + more_H, g + more_g
        H = H + self._weight
        g = g - self._weight @ state[self.free]
        held = np.array([HELD, HELD, HELD, HELD_ROTATION])[self.free]
        step = np.linalg.solve(H + np.diag(1.0 / np.square(held)), g)
        whole = np.zeros(4)
        whole[self.free] = step
        length, turn = float(np.linalg.norm(whole[:3])), abs(float(whole[3]))
        whole *= min(1.0, LONGEST / max(length, 1e-12), WIDEST / max(turn, 1e-12))
        found = state + whole
        found[3] = np.clip(found[3], -self._rotation, self._rotation)
        return found, H

    def _edges(self, state: Array, rendered: _Rendered) -> tuple[Array, Array]:
        """Information matrix and gradient of edges: of outlines, and of what is in front of other parts of the body.

        Pixels that are nearer or farther than rendered, by more than noise, are -1 or 1. Blurred, they are e g(x) where
        an edge is off by e pixels, with the profile g of the blur; the sum of g^2 across the edge is 1 / (2 sqrt(pi)
        BLUR), so this weight gives each pixel along the edge (e / EDGE)^2. Pixels that another thing covers are -1 at
        any state, so they have no effect.
        """
        from scipy.ndimage import gaussian_filter

        picture = self._picture
        sigma = picture.noise.copy()
        sigma.reshape(-1)[rendered.at] = rendered.sigma

        def misfit(depth: Array) -> Array:
            error = picture.depth - np.minimum(depth, picture.expected)
            sign = np.clip(np.abs(error) - GATE * sigma, 0.0, JUMP) / JUMP
            return np.where(self._seen, np.copysign(sign, error), 0.0)

        def blurred(values: Array) -> Array:
            return np.asarray(gaussian_filter(values, BLUR, truncate=3.0)).reshape(-1)

        length = BLUR * float(np.linalg.norm(self.pose(state).p - picture.X_WC.p)) / picture.lens.fx
        deltas = np.array([length, length, length, length / self._radius])
        columns = []
        for k in self.free:
            step = np.zeros(4)
            step[k] = deltas[k]
            ends = [misfit(self._see(state + sign * step)[0]) for sign in (-1.0, 1.0)]
            columns.append(blurred(ends[0] - ends[1]) / (2.0 * deltas[k]))
        J = np.stack(columns, axis=1)
        weight = 2.0 * math.sqrt(math.pi) * BLUR / EDGE**2
        H, g = _normal_equations(J, blurred(misfit(rendered.depth)))
        return weight * H, weight * g

    def compare(self, state: Array, slack: float = 0.0) -> Comparison:
        """How a state explains the picture; `slack` [m] is added to the depth errors that are explained."""
        picture, rendered = self._picture, self._render(state)
        at, most = rendered.at, GATE**2
        error = picture.depth.reshape(-1)[at] - rendered.depth.reshape(-1)[at]
        seen, near = self._seen.reshape(-1)[at], picture.near.reshape(-1)[at]
        allowed = GATE * rendered.sigma + slack
        with np.errstate(invalid="ignore"):
            explained = np.abs(error) <= allowed
            missing = error > allowed
        covered = seen & ~explained & ~missing & near
        wrong = picture.near.copy()
        wrong.reshape(-1)[at] = missing | covered
        bad, count = int(wrong.sum()), int(explained.sum())
        ratio = error[explained] / rendered.sigma[explained]
        squares = np.square(ratio)
        return Comparison(
            explained=count,
            missing=int(missing.sum()),
            covered=int(covered.sum()),
            beside=int(picture.near.sum()) - int(near.sum()),
            against=int(patches(wrong).sum()),
            cost=float(np.minimum(squares, most).sum()) + most * bad,
            residual=math.sqrt(float(np.square(error[explained]).mean())) if count else 0.0,
            spread=math.sqrt(float(squares.mean())) if count else 0.0,
        )


def _normal_equations(J: Array, residual: Array) -> tuple[Array, Array]:
    """J^T J and J^T r; summed in an order that does not depend on the number of threads."""
    return np.einsum("ni,nj->ij", J, J), np.einsum("ni,n->i", J, residual)
