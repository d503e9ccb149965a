"""Solids as files: STL and 3MF in mm. Equal solids give equal bytes."""

from __future__ import annotations

import struct

import numpy as np
from manifold3d import Manifold

from engine.fabrication.parts.solids import triangles
from engine.files import zip_bytes

_CONTENT_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    "</Types>\n"
)
_RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0"'
    ' Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
    "</Relationships>\n"
)


def stl_bytes(solid: Manifold, name: str) -> bytes:
    """Return binary STL in mm; its header names the part and the unit, which STL itself does not know."""
    vertices, faces = triangles(solid)
    corners = vertices[faces].astype("<f4")
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    records = np.zeros(len(faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")])
    records["normal"], records["corners"] = normals, corners
    # a header that starts with "solid" would be taken for a text file
    header = f"TensAtlas {name}, unit: millimetre".encode("ascii", "replace")[:80].ljust(80)
    return header + struct.pack("<I", len(faces)) + records.tobytes()


def threemf_bytes(solid: Manifold, name: str) -> bytes:
    """Return a 3MF package (core specification 1.3) in mm with one object; ``name`` is plain ASCII."""
    vertices, faces = triangles(solid)
    points = "".join(f'<vertex x="{x:.5f}" y="{y:.5f}" z="{z:.5f}"/>' for x, y, z in vertices)
    sides = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces)
    model = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<model unit="millimeter" xml:lang="en-US"'
        ' xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
        f'<metadata name="Title">{name}</metadata><metadata name="Application">TensAtlas</metadata>'
        f'<resources><object id="1" type="model" name="{name}"><mesh><vertices>{points}</vertices>'
        f"<triangles>{sides}</triangles></mesh></object></resources>"
        '<build><item objectid="1"/></build></model>\n'
    )
    return zip_bytes(
        {
            "[Content_Types].xml": _CONTENT_TYPES.encode(),
            "_rels/.rels": _RELATIONS.encode(),
            "3D/3dmodel.model": model.encode(),
        }
    )
