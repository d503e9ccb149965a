import io
import xml.etree.ElementTree as ET

import ezdxf
import pytest
from shapely.geometry import Polygon
from svg.path import parse_path

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import design_cables
from engine.fabrication.dimensions.pull_test import coupon
from engine.fabrication.materials import PRESETS, load_materials
from engine.fabrication.parts.net import module_net
from engine.fabrication.parts.net_files import SCALE_BAR, coupon_drawing, dxf_bytes, net_drawing, svg_bytes
from engine.fabrication.parts.shapes import net_outline

MATERIALS = load_materials("tpu-85a")
PRINTER = MATERIALS.printer
SVG = "{http://www.w3.org/2000/svg}"


def design_of(level, name="tpu-85a"):
    return design_cables(Morphology(level, (1, 2)), load_materials(name))[0]


@pytest.mark.parametrize("name", PRESETS)
def test_svg_is_true_to_scale(name):
    design = design_of(6, name)
    net = module_net(design, PRINTER)
    root = ET.fromstring(svg_bytes(net_drawing(net, design)))
    width, height = root.get("width"), root.get("height")
    assert width.endswith("mm")
    assert height.endswith("mm")
    box = list(map(float, root.get("viewBox").split()))
    assert box == [0, 0, float(width[:-2]), float(height[:-2])]  # one unit is one millimetre
    groups = {g.get("id"): g for g in root.iter(f"{SVG}g")}
    assert set(groups) == {"CUT", "REST", "ENGRAVE"}
    rest = {p.get("id"): parse_path(p.get("d")) for p in groups["REST"]}
    assert set(rest) == {f"cable_{a}_{b}" for a, b in t.CABLES}
    for path in rest.values():
        assert path.length() == pytest.approx(1e3 * design.free, abs=2e-3)
    (bar,) = [p for p in root.iter(f"{SVG}path") if p.get("id") == "scale_bar"]
    assert parse_path(bar.get("d")).length() == pytest.approx(SCALE_BAR)
    texts = {e.text for e in root.iter(f"{SVG}text")}
    assert {e.label for e in net.eyelets} | {f"face {f}" for f in t.FACES} <= texts
    everything = [
        x for p in root.iter(f"{SVG}path") for s in parse_path(p.get("d")) for x in (s.start, s.end)
    ]
    assert min(z.real for z in everything) > 0
    assert max(z.real for z in everything) < box[2]
    assert min(z.imag for z in everything) > 0
    assert max(z.imag for z in everything) < box[3]


@pytest.mark.parametrize("level", [3, 10])
def test_dxf_is_true_to_scale(level):
    design = design_of(level)
    net = module_net(design, PRINTER)
    content = dxf_bytes(net_drawing(net, design))
    document = ezdxf.read(io.StringIO(content.decode()))
    assert document.units == ezdxf.units.MM
    assert not document.audit().errors
    space = document.modelspace()
    assert space.units == ezdxf.units.MM
    lengths = [e.dxf.start.distance(e.dxf.end) for e in space.query('LINE[layer=="REST"]')]
    assert lengths == pytest.approx([1e3 * design.free] * 24)
    bars = [e.dxf.start.distance(e.dxf.end) for e in space.query('LINE[layer=="ENGRAVE"]')]
    assert SCALE_BAR in bars
    rings = [Polygon([p[:2] for p in e.get_points()]) for e in space.query('LWPOLYLINE[layer=="CUT"]')]
    assert all(e.closed for e in space.query("LWPOLYLINE"))
    outer = max(rings, key=lambda r: r.area)
    area = outer.area - sum(r.area for r in rings if r is not outer)
    assert area == pytest.approx(net_outline(net, design).area)
    x0, y0, x1, y1 = outer.bounds
    assert (x1 - x0, y1 - y0) == pytest.approx((1e3 * net.size[0], 1e3 * net.size[1]), abs=0.02)
    assert {e.label for e in net.eyelets} <= {e.dxf.text for e in space.query("TEXT")}


def test_drawings_hold_no_date_and_no_random_number():
    design = design_of(5)
    net = module_net(design, PRINTER)
    assert svg_bytes(net_drawing(net, design)) == svg_bytes(net_drawing(net, design))
    content = dxf_bytes(net_drawing(net, design))
    assert content == dxf_bytes(net_drawing(net, design))
    # ezdxf keeps kinds of objects in a set, whose order differs from process to process
    document = ezdxf.read(io.StringIO(content.decode()))
    declared = [c.dxf.name for c in document.classes]
    used = [name for name in declared if name in document.entitydb.dxf_types_in_use()]
    assert len(used) > 1
    assert used == sorted(used)
    lines = content.decode().splitlines()
    values = {line: lines[i + 2] for i, line in enumerate(lines) if line.startswith("$")}
    assert {values[k] for k in ("$TDCREATE", "$TDUPDATE", "$TDUCREATE", "$TDUUPDATE")} == {"2451545.0"}
    assert set(values["$VERSIONGUID"]) | set(values["$FINGERPRINTGUID"]) <= set("{}-0")
    assert "2000-01-01" in content.decode()


def test_the_coupon_is_drawn_with_its_marks():
    c = coupon(Morphology(2, (1, 2)), load_materials())
    document = ezdxf.read(io.StringIO(dxf_bytes(coupon_drawing(c)).decode()))
    space = document.modelspace()
    marks = [e.dxf.start.x for e in space.query('LINE[layer=="REST"]')]
    assert abs(marks[1] - marks[0]) == pytest.approx(1e3 * c.gauge_length)
    outer, *holes = sorted(
        (Polygon([p[:2] for p in e.get_points()]) for e in space.query('LWPOLYLINE[layer=="CUT"]')),
        key=lambda ring: -ring.area,
    )
    assert len(holes) == 2
    # as wide as it says between the marks
    middle = outer.intersection(Polygon([(m, y) for m in (marks[0], marks[1]) for y in (-99, 99)]).envelope)
    _, y0, _, y1 = middle.bounds
    assert y1 - y0 == pytest.approx(1e3 * c.width)
    assert outer.bounds[:2] == pytest.approx((0.0, 0.0))
