"""The folder of a kit for a robot's first module: what to buy, print and measure before the others."""

from __future__ import annotations

from typing import Final

from app.downloads.robot_folder import list_of_files, materials_text, place_of
from engine.export import simulate_trial
from engine.fabrication.as_built import twin_of
from engine.fabrication.dimensions.cable_problems import makeable
from engine.fabrication.dimensions.cables import design_cables
from engine.fabrication.dimensions.feet import robot_feet
from engine.fabrication.firmware import firmware_files
from engine.fabrication.folder import fabrication_files
from engine.fabrication.kit.jig import robot_jig
from engine.fabrication.kit.lone_module import LoneModule
from engine.fabrication.kit.measured import measured_form
from engine.fabrication.materials import Materials
from engine.fabrication.parts.net import module_net
from engine.storage.reader import RunReader
from viz.build_sheet import style
from viz.build_sheet.facts import ArchivePlace, gather
from viz.build_sheet.kit.kit_sheet import kit_sheet
from viz.build_sheet.kit.module_scene import module_scene
from viz.build_sheet.kit.tiles import net_tiles
from viz.build_sheet.style import PaperName

_WHAT: Final = (
    ("kit.pdf", "start here: what to buy, picture by picture, what to measure"),
    ("measured.toml", "the materials file as a form: fill it in and export with --materials measured.toml"),
    ("net_tiles.pdf", "the net at 1:1 over sheets of paper with marks: print it at 100 %"),
    ("parts/jig.*", "holds the six rods while the net goes on"),
    ("parts/*", "parts to print, in mm"),
    ("net/*", "the flat net as DXF and SVG at 1:1"),
    ("module.glb", "the module to look at in 3D, in metres, y up"),
    ("bill_of_materials.csv", "parts with masses"),
    ("tables/*", "cut lists of rods and cables"),
    ("firmware/*", "the robot's sketch: this module is the one at its first pin"),
)


def kit_folder(
    reader: RunReader,
    number: int,
    *,
    materials: Materials,
    place: ArchivePlace | None = None,
    paper: PaperName = "a4",
) -> dict[str, bytes]:
    """Return name and content of every file of a kit; equal arguments give equal bytes.

    Args:
        reader: of the run.
        number: of the robot's evaluation.
        materials: what it is to be built from; a preset that its cables cannot be made of is replaced.
        place: archive and cell that it was found in; None to look them up.
        paper: to print on.

    Raises:
        RunFileError: there is no such evaluation, or it is damaged.
        ExportError: its simulation failed, so that there is nothing to show.
        InvalidData: the materials' file can no longer be read.
    """
    evaluation = reader.evaluation(number)
    trial = simulate_trial(reader.config, evaluation)
    body = evaluation.solution.morphology
    materials = makeable(body, materials)
    feet = robot_feet(reader.config, evaluation).feet
    twin = twin_of(reader.config.physics, body, materials, feet=feet)
    facts = gather(reader, evaluation, trial, place or place_of(reader, number), twin)
    module = LoneModule.of(body)
    (design,) = design_cables(module, materials)
    made = fabrication_files(module, materials, tuple(f for f in feet if f.module == 0))
    glb = made.pop("robot.glb")
    del made["joints.csv"]
    files = {name if "/" in name or "bill" in name else f"tables/{name}": made[name] for name in made}
    files["module.glb"] = glb
    title = f"Net of module 1 of {facts.name}"
    net = module_net(design, materials.printer)
    files["net_tiles.pdf"], _ = net_tiles(net, design, style.PAPERS[paper], title)
    friction = reader.config.physics.feet_friction if feet else None
    text = materials_text(materials)
    files["kit.pdf"], _ = kit_sheet(
        facts, materials, text, module_scene(glb, robot_jig(module, materials)), paper
    )
    files["measured.toml"] = measured_form(text, module, materials, friction).encode()
    sketch = firmware_files(reader.config, evaluation, run=facts.run_name, as_built=twin.nominal)
    files |= {f"firmware/{name}": content for name, content in sketch.items()}
    heading = f"# A kit for module 1 of {facts.name} of {facts.run_name}\n\n"
    files["README.md"] = (heading + list_of_files(files, _WHAT)).encode()
    return files
