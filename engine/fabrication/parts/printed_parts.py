"""The parts to print, their number, material and settings, from the robot's model and the materials."""

from __future__ import annotations

import dataclasses
import functools
from typing import Final

from manifold3d import Manifold

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import design_cables
from engine.fabrication.dimensions.feet import TEST_FEET, TEST_LEAN, Foot, foot_name
from engine.fabrication.dimensions.pull_test import coupon
from engine.fabrication.materials import Materials
from engine.fabrication.parts import solids
from engine.fabrication.parts.drum import drum_discs
from engine.fabrication.parts.foot import foot, sled
from engine.fabrication.parts.head_tag import tag_clip, tag_plate
from engine.fabrication.parts.net import module_net, net_name
from engine.fabrication.parts.servo_parts import ballast_length, laid, mount_blank, servo_mount
from engine.fabrication.parts.shapes import cap, coupon_solid, link, net_solid

FLEXIBLE_DENSITY: Final = 1190.0
"""Of a flexible filament (TPU), in kg/m3, for links where the net is cut from a sheet; assumed."""
CORNER_AREA: Final = 0.1
"""Area of a sharp corner that a disc cannot reach, in mm2: less than this is no thin wall."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class PrintedPart:
    """A part to print, as it lies on the bed: its lowest point at z = 0.

    Attributes:
        name: of its files, without ending: ``cap_16.0mm``.
        quantity: how many the robot needs.
        modules: that need it.
        solid: in mm.
        flexible: whether it is printed of the cables' material; otherwise of ``[plastic]``.
        density: in kg/m3.
        min_wall: what its walls were checked against, in mm.
        thin_area: largest area in a slice that is thinner than that, in mm2.
        fits: whether it lies inside the printer's bed.
        note: what it is for.
        print_it: how to print it.
    """

    name: str
    quantity: int
    modules: tuple[int, ...]
    solid: Manifold
    flexible: bool
    density: float
    min_wall: float
    thin_area: float
    fits: bool
    note: str
    print_it: str

    @property
    def walls_hold(self) -> bool:
        """Whether no wall is thinner than ``min_wall``; a corner's tip does not count."""
        return self.thin_area <= CORNER_AREA

    @property
    def volume(self) -> float:
        """In m3."""
        return 1e-9 * self.solid.volume()

    @property
    def mass(self) -> float:
        """Of one, printed solid, in kg."""
        return self.density * self.volume

    @property
    def size(self) -> tuple[float, float, float]:
        """In x, y and z, in m."""
        x, y, z = solids.extent(self.solid)
        return 1e-3 * x, 1e-3 * y, 1e-3 * z


@functools.lru_cache(maxsize=32)
def printed_parts(
    morphology: Morphology, materials: Materials, feet: tuple[Foot, ...] = ()
) -> tuple[PrintedPart, ...]:
    """Return the parts to print for a robot with these feet, each kind once with its quantity."""
    designs = design_cables(morphology, materials)
    n = morphology.n_modules
    everywhere = tuple(range(n))
    result = []
    by_level = {d.level: d for d in designs}
    for level, design in sorted(by_level.items()):
        modules = tuple(d.module for d in designs if d.level == level)
        if materials.cable.form == "printed":
            net = module_net(design, materials.printer)
            result.append(
                _part(
                    net_name(level),
                    len(modules),
                    modules,
                    net_solid(net, design),
                    materials,
                    "the 24 cables of a module in one piece",
                    "as it lies, no support; lines along the cables; this side up = outside",
                    flexible=True,
                )
            )
        result.append(
            _part(
                f"cap_stiffness_{level / t.N_STIFFNESS_LEVELS:.1f}",
                2 * len(t.RODS) * len(modules),
                modules,
                cap(design, materials.printer, footed=bool(feet)),
                materials,
                "on every rod end; the rings of the net lie on its post",
                "on its sleeve's end, knob up, with a brim, no support",
                # a slanting hole leaves a sharp rim, which is no thin wall
                walls=cap(design, materials.printer, line=False),
            )
        )
    result += [
        _part(
            "servo_mount",
            n,
            everywhere,
            laid(servo_mount(materials)),
            materials,
            "between the halves of each servo rod; holds servo and counterweight and guides the five lines",
            "the ball up, with support; drill the holes of arm and ball free, 1 mm",
            # where a slanting hole leaves a ball its rim is sharp, which is no thin wall
            walls=laid(mount_blank(materials.servo, materials.printer, ballast_length(materials))),
        ),
        *(
            _part(
                f"servo_drum_{k}",
                n,
                everywhere,
                disc,
                materials,
                "a disc of the drum, the lowest is 1; five cams wind the internal cables while it turns"
                " counter-clockwise, seen from the shaft's end",
                "peg up, no support",
            )
            for k, disc in enumerate(drum_discs(materials.servo), start=1)
        ),
    ]
    for name, solid, note, how in (
        ("tag_clip", tag_clip(materials.printer), "on a rod of the head, for the tag's wire", "on its end"),
        ("tag_plate", tag_plate(), "above the head point, for the tag that a camera sees", "boss up"),
    ):
        result.append(_part(name, 1, everywhere, solid, materials, note, f"{how}, no support"))
    if n > 1:
        result.append(
            _part(
                "link",
                len(t.JOINT_ORDER) * (n - 1),
                everywhere,
                link(),
                materials,
                "ties two rod ends of neighbouring modules",
                "flat, no support",
                flexible=True,
            )
        )
    if feet:
        result += _feet(feet, materials)
    if materials.cable.form == "printed":
        result.append(
            _part(
                "pull_coupon",
                1,
                everywhere,
                coupon_solid(coupon(morphology, materials)),
                materials,
                "for the pull test",
                "first; flat, lines along it, exactly as the net will be printed",
                flexible=True,
            )
        )
    return tuple(result)


def _feet(feet: tuple[Foot, ...], materials: Materials) -> list[PrintedPart]:
    """Return the feet of a robot, one kind for each lean, and what their friction test needs."""
    result = []
    for lean in sorted({f.lean for f in feet} | {TEST_LEAN}):
        own = [f for f in feet if f.lean == lean]
        tested = TEST_FEET if lean == TEST_LEAN else 0
        where = [f"on rod ends, numbers {', '.join(str(f.number) for f in own)}"] if own else []
        where += [f"{tested} for the friction test"] if tested else []
        result.append(
            _part(
                foot_name(lean),
                len(own) + tested,
                tuple(sorted({f.module for f in own})),
                foot(lean),
                materials,
                f"foot that slides at {lean} degrees to its rod; {'; '.join(where)}",
                "on its rim, the ball up, no support; layers of 0.1 mm; keep kinds apart, they look alike",
                flexible=True,
                walls=foot(lean, scales=False),
            )
        )
    result.append(
        _part(
            "friction_sled",
            1,
            (),
            sled(),
            materials,
            "for the friction test: an arrow that stands on three feet",
            "on its plate, the knobs up, no support",
        )
    )
    return result


def _part(
    name: str,
    quantity: int,
    modules: tuple[int, ...],
    solid: Manifold,
    materials: Materials,
    note: str,
    print_it: str,
    *,
    flexible: bool = False,
    walls: Manifold | None = None,
) -> PrintedPart:
    printer = materials.printer
    wall = 1e3 * (printer.nozzle if flexible else printer.min_wall)
    low = solid.bounding_box()
    solid = solid.translate((-low[0], -low[1], -low[2]))
    size = solids.extent(solid)
    bed = (printer.bed_x, printer.bed_y, printer.bed_z)
    density = materials.plastic.density
    if flexible:
        # links are printed even where the net is cut
        density = materials.cable.density if materials.cable.form == "printed" else FLEXIBLE_DENSITY
    return PrintedPart(
        name=name,
        quantity=quantity,
        modules=modules,
        solid=solid,
        flexible=flexible,
        density=density,
        min_wall=wall,
        thin_area=solids.thin_area(walls or solid, wall),
        fits=all(s <= 1e3 * b + 1e-6 for s, b in zip(size, bed, strict=True)),
        note=note,
        print_it=print_it,
    )
