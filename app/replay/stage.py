"""The stage of every 3D scene: its light, and a floor that fades to a horizon.

There are no shadow maps and no pictures of surroundings: a computer without a graphics card would need
seconds to prepare them, and would redraw every robot three times a frame. The soft shadows of
``floor_marks`` cost nothing.
"""

from __future__ import annotations

import math
from typing import Final

import viser

from app.replay.floor_marks import disc_glb

FIELD_OF_VIEW: Final = math.radians(38.0)
"""From the lower edge to the upper one: a long lens, from near by."""
LINE_PITCH: Final = 0.25
"""Metres between the lines of the floor."""
HORIZON: Final = 3.2
"""Metres from below the camera at which the floor has faded away."""
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
    scene.add_grid(
        "/stage/floor",
        infinite_grid=True,
        cell_size=LINE_PITCH,
        cell_thickness=0.8,
        cell_color=(96, 106, 120),
        section_size=4 * LINE_PITCH,
        section_thickness=1.0,
        section_color=(112, 124, 140),
        plane_opacity=0.0,
        fade_distance=HORIZON,
        fade_strength=1.6,
        shadow_opacity=0.0,
    )
    scene.add_batched_glb(
        "/stage/pool",
        disc_glb(POOL),
        batched_wxyzs=((1.0, 0.0, 0.0, 0.0),),
        batched_positions=((0.0, 0.0, -0.001),),
        batched_scales=(POOL_RADIUS,),
        lod="off",
        cast_shadow=False,
        receive_shadow=False,
    )
