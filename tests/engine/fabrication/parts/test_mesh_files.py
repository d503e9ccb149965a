import io
import xml.etree.ElementTree as ET
import zipfile

import pytest
import trimesh

from engine.body.morphology import Morphology
from engine.fabrication.materials import load_materials
from engine.fabrication.parts.mesh_files import threemf_bytes
from engine.fabrication.parts.printed_parts import printed_parts

BODY = Morphology((3, 9), (1, 2))
MATERIALS = load_materials("tpu-85a")
CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"


def test_3mf_says_millimetre_and_holds_the_same_body():
    for part in printed_parts(BODY, MATERIALS):
        content = threemf_bytes(part.solid, part.name)
        with zipfile.ZipFile(io.BytesIO(content)) as package:
            assert "[Content_Types].xml" in package.namelist()
            model = ET.fromstring(package.read("3D/3dmodel.model"))
        assert model.get("unit") == "millimeter"
        vertices = [[float(v.get(k)) for k in "xyz"] for v in model.iter(f"{CORE}vertex")]
        faces = [[int(f.get(k)) for k in ("v1", "v2", "v3")] for f in model.iter(f"{CORE}triangle")]
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        assert mesh.is_watertight
        assert mesh.volume == pytest.approx(1e9 * part.volume, rel=1e-3)
