"""The noise of a segment's frame: what noise of its own markers does to points that are seen in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_skel.segments.pose import Array
from mocap_skel.segments.shape import Shape
from mocap_skel.spherefit import Moments

# _CROSS[j] @ v is the j-th unit vector × v.
_CROSS = np.array(
    [
        [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]],
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    ]
)


@dataclass(frozen=True, eq=False)
class Lever:
    """The noise of the parent's frame, from the noise of its markers, for a σ of 1.

    The frame turns about its axes by independent small angles, and a point y moves by angle × y.

    Attributes:
        origin: (3, 3) covariance of the frame's origin.
        turns: (3,) variances of the angles, radians² a metre².
        axes: (3, 3), the axes of the turns as rows.
        cross: (3, 3, 3), their cross products: cross[k] @ y is axis k × y.
    """

    origin: Array
    turns: Array
    axes: Array
    cross: Array

    @staticmethod
    def of(shape: Shape | None, noise: Array | None = None) -> Lever | None:
        """The noise of a frame on a shape; None for one on one marker, whose noise its place does not tell.

        With Σ a marker's noise, n its displacement, t its place about the centroid and I = Σ |t|² - t tᵀ,
        a least-squares frame moves by the mean of n and turns by I⁻¹ Σ t × n: independent of each other.

        Args:
            shape: the points that the frame stands on.
            noise: (3, 3) of a marker for a σ of 1; the unit matrix if None.
        """
        if shape is None:
            return None
        template = shape.template[np.isfinite(shape.template[:, 0])]
        centred = template - template.mean(axis=0)
        scatter = centred.T @ centred
        angles = np.linalg.inv(np.trace(scatter) * np.eye(3) - scatter)
        if noise is None:
            noise = np.eye(3)
        else:
            arms = np.einsum("mj,jil->mil", centred, _CROSS)
            angles = angles @ np.einsum("mij,jk,mlk->il", arms, noise, arms) @ angles
        turns, axes = np.linalg.eigh(angles)
        return Lever(noise / len(centred), turns, axes.T, np.einsum("kj,jil->kil", axes.T, _CROSS))

    def covariance(self, moments: Moments) -> Array:
        """(M, 3, 3): the noise that the frame gives to points of these moments (M,), averaged over them."""
        at = moments.mean[..., :, None] * moments.mean[..., None, :] + moments.covariance
        # u × y over all places y of the marker: [u]× E[y yᵀ] [u]×ᵀ
        each = self.cross @ at[:, None] @ self.cross.transpose(0, 2, 1)
        return np.asarray(np.einsum("k,mkij->mij", self.turns, each) + self.origin)

    def third_moment(self, moments: Moments, inside: Array) -> Array:
        """(M, 3), m: what the noise adds to the third moment, for it grows with the distance from the frame.

        With e the noise at y = ȳ + d, E[S] gains E[d |e|²] + 2 E[e (e·d)]. For a turn about u, |e|² is
        |u × y|² and e (e·d) is (u × y)((u × ȳ)·d). Noise that is the same everywhere adds nothing.

        Args:
            moments: (M,) of the points.
            inside: (frames, M, 3), the points, NaN = missing.
        """
        deviation = inside - moments.mean
        deviation[np.isnan(deviation)] = 0.0
        along = (deviation.reshape(-1, 3) @ self.axes.T).reshape(deviation.shape)
        below = np.maximum(moments.count - 1.0, 1.0)[:, None, None]
        squared = (along * along).transpose(1, 2, 0) @ deviation.transpose(1, 0, 2) / below
        arm = np.einsum("kij,mj->mki", self.cross, moments.mean)
        # |u × y|² is y·(-[u]×²)y, and -[u]× (u × ȳ) is the part of ȳ across u.
        across = -np.einsum("kij,mkj->mki", self.cross, arm)
        each = (
            2 * np.einsum("mij,mkj->mki", moments.covariance, across)
            + moments.third[:, None]
            - squared
            + 2 * np.einsum("kij,mjl,mkl->mki", self.cross, moments.covariance, arm)
        )
        return np.asarray(np.einsum("k,mki->mi", self.turns, each))
