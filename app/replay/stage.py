"""The stage of every 3D scene: its light, and a floor that fades to a horizon.

There are no shadow maps and no pictures of surroundings: a computer without a graphics card would need
seconds to prepare them, and would redraw every robot three times a frame. The soft shadows of
``shapes`` cost nothing.
"""

from __future__ import annotations

import functools
import math
from typing import Final

import numpy as np
import viser

from app.replay.shapes import disc_glb, flat_glb

FIELD_OF_VIEW: Final = math.radians(38.0)
"""From the lower edge to the upper one: a long lens, from near by."""
LINE_PITCH: Final = 0.25
"""Metres between the lines of the floor."""
HORIZON: Final = 4.0
"""Metres from where a robot is dropped at which the floor has faded away."""
LINE_COLOR: Final = (128, 140, 156)
WEAK, STRONG = 120, 190
"""How much a line covers in the middle, of 255, and every fourth one."""
LINE_WIDTH: Final = 0.0012
LINE_GROWTH: Final = 2.0
"""By how many of its widths a line is wider at the horizon, where it would fall between the pixels."""
LINE_PARTS: Final = 16
POOL_RADIUS: Final = 1.6
POOL: Final = ((255, 248, 236, 62), (255, 248, 236, 40), (255, 248, 236, 14), (255, 248, 236, 0))
"""The light on the floor, brightest in its middle: colour and how much it covers, of 255."""


def set_stage(scene: viser.SceneApi) -> None:
    """Light a scene and lay its floor."""
    scene.set_up_direction("+z")
    scene.configure_environment_map(None)
    scene.configure_default_lights(enabled=False)
    scene.add_light_hemisphere(
        "/stage/sky", sky_color=(214, 226, 255), ground_color=(92, 84, 76), intensity=1.5
    )
    scene.add_light_directional(
        "/stage/key", color=(255, 232, 204), intensity=2.3, position=(-1.2, -1.6, 2.6)
    )
    scene.add_light_directional("/stage/rim", color=(150, 190, 255), intensity=1.3, position=(1.6, 1.8, 0.9))
    _lay(scene, "lines", _lines_glb(), 1.0, -0.0005)
    _lay(scene, "pool", disc_glb(POOL), POOL_RADIUS, -0.001)


def _lay(scene: viser.SceneApi, name: str, glb: bytes, size: float, height: float) -> None:
    scene.add_batched_glb(
        f"/stage/{name}",
        glb,
        batched_wxyzs=((1.0, 0.0, 0.0, 0.0),),
        batched_positions=((0.0, 0.0, height),),
        batched_scales=(size,),
        lod="off",
        cast_shadow=False,
        receive_shadow=False,
    )


@functools.cache
def _lines_glb() -> bytes:
    """Return the lines of the floor, in m: strips that grow wider, and fade, with their distance from 0.

    viser's own grid computes a line's share of every pixel of the floor, which takes a computer without a
    graphics card as long as all the rest of a picture.
    """
    n = int(HORIZON / LINE_PITCH)
    first = np.arange(0, 2 * LINE_PARTS, 2)[:, None]
    quads = np.concatenate([first + np.array(corners) for corners in ((0, 1, 3), (0, 3, 2))])
    places: list[np.ndarray] = []
    colors, faces = [], []
    for k in range(-n, n + 1):
        across = k * LINE_PITCH
        side = math.sqrt(HORIZON**2 - across**2)
        along = np.linspace(-side, side, LINE_PARTS + 1)
        away = np.hypot(along, across) / HORIZON
        half = LINE_WIDTH / 2.0 * (1.0 + LINE_GROWTH * away)
        cover = np.round((STRONG if k % 4 == 0 else WEAK) * (1.0 - away) ** 1.5)
        edges = [np.stack([along, across + s * half, 0.0 * along], axis=-1) for s in (-1.0, 1.0)]
        strip = np.stack(edges, axis=1).reshape(-1, 3)
        for order in ([0, 1, 2], [1, 0, 2]):
            faces.append(quads + len(places) * len(strip))
            places.append(strip[:, order])
            colors.append(np.column_stack([np.tile(LINE_COLOR, (len(strip), 1)), np.repeat(cover, 2)]))
    return flat_glb(np.concatenate(places), np.concatenate(colors), np.concatenate(faces))
