"""The scene of one module for its pictures, standing in its jig."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.fabrication.kit.jig import Jig
from engine.fabrication.parts import solids
from viz.build_sheet.kit.scene_pictures import ScenePictures

COLOR = (84, 140, 96)
"""Of the jig."""


def module_scene(glb: bytes, jig: Jig | None) -> ScenePictures:
    """Return the scene of a lone module, turned as it stands in its jig.

    Args:
        glb: of the module.
        jig: to add; None for none.
    """
    scene = ScenePictures(glb)
    if jig is None:
        return scene
    # where the jig and the scene have the rods
    held = 1e-3 * np.array([jig.nodes[list(ends)].mean(axis=0) for ends in t.RODS])
    drawn = np.array([scene.middle(f"*_rod{r}") for r in range(len(t.RODS))])
    turn, _ = Rotation.align_vectors(held - held.mean(axis=0), drawn - drawn.mean(axis=0))
    scene.stand(turn.as_matrix(), held.mean(axis=0) - turn.apply(drawn.mean(axis=0)))
    vertices, faces = solids.triangles(jig.solid)
    scene.add("jig", 1e-3 * vertices, faces, COLOR)
    return scene
