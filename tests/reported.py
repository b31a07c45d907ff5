"""Report pages of the bundled clips, and what is packed in them."""

import base64
import json
import re
from functools import cache

from recordings import ASSOCIATIONS, SAMPLES, known

from mocap_skel import associate, fit_skeleton, read_clip
from mocap_skel.report.html import PageContent
from mocap_skel.report.scene import unpack


def shown_of(clip, association="cmu"):
    found = known(association)
    assignment = associate(clip, found)[0]
    fit = fit_skeleton(clip, assignment, found.skeleton)
    return PageContent(clip, assignment, fit, ("read <well>",), "mocap-skel report")


@cache
def shown(name):
    return shown_of(read_clip(SAMPLES / f"{name}.c3d"), ASSOCIATIONS[name])


def block(html, name):
    return re.search(rf'<script type="[a-z/]+" id="{name}">(.*?)</script>', html, re.S)[1]


def rows_of(html):
    about = json.loads(block(html, "scene"))
    return about, unpack(base64.b64decode(block(html, "samples")), about["frames"])
