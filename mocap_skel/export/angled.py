"""What formats of joint angles share. Light, as the register asks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mocap_skel.errors import ExportError
from mocap_skel.export.animated import Tracks

if TYPE_CHECKING:
    from mocap_skel.angles.joint_angles import Angles
    from mocap_skel.export.registry import Source
    from mocap_skel.skeleton_fit import SkeletonFit

LACKS = "so it cannot be turned back into a moving figure"


@dataclass(frozen=True)
class AngleOptions(Tracks):
    """What a format of angles may be told: as tracks, the angles of the rigid figure."""

    def angles_of(self, fit: SkeletonFit, source: Source) -> tuple[Angles, tuple[str, ...]]:
        """The joint angles that are asked for, and notes on them; a static clip's mean pose is neutral.

        Raises:
            ExportError: the figure has no joint whose angles are defined.
        """
        from mocap_skel.angles.joint_angles import joint_angles

        fit, made = self.fit_of(fit)
        angles = joint_angles(fit, source.static)
        if not angles.joints:
            raise ExportError(
                f"{fit.clip}: no joint of the figure {fit.skeleton.name} has angles that are defined",
                "docs/angles.md lists those that are, and the landmarks that they need",
            )
        return angles, tuple(f"angles: {note}" for note in (*made, *angles.notes))
