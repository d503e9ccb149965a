"""From whom a robot descends, and what changed on the way."""

from __future__ import annotations

import dataclasses

from engine.body.morphology import Morphology


@dataclasses.dataclass(frozen=True, slots=True)
class Ancestor:
    """One robot of a lineage.

    Attributes:
        number: of its evaluation.
        parent: number of the robot that it descends from, None for a random one.
        generation: of its evaluation.
        operator: how it came about, as in ``Solution``.
        fitness: in m, None if a simulation failed.
        morphology: its body.
    """

    number: int
    parent: int | None
    generation: int
    operator: str
    fitness: float | None
    morphology: Morphology

    @property
    def is_founder(self) -> bool:
        """Whether it descends from nobody: its genes were drawn at random."""
        return self.parent is None


def body_changes(parent: Morphology, child: Morphology) -> list[str]:
    """Return what differs between two bodies, in words; modules count from 1.

    Where a module came in or went, it is the one that leaves the fewest differences in the others.
    """
    old, new = list(parent.faces), list(child.faces)
    changes = []
    moved = len(new) - len(old)
    kept = list(range(len(new)))  # modules of the child that have a counterpart in the parent
    if abs(moved) == 1:
        longer, shorter = (new, old) if moved > 0 else (old, new)
        at = min(range(len(longer)), key=lambda i: _differences(longer[:i] + longer[i + 1 :], shorter))
        changes.append(f"module {at + 1} {'added' if moved > 0 else 'removed'}")
        if moved > 0:
            kept.remove(at)
            new = new[:at] + new[at + 1 :]
        else:
            old = old[:at] + old[at + 1 :]
    elif moved:
        return [f"{len(old)} → {len(new)} modules"]
    turned = [kept[i] + 1 for i, (a, b) in enumerate(zip(old, new, strict=True)) if a != b]
    if turned:
        changes.append(f"face{'s' if len(turned) > 1 else ''} of {', '.join(map(str, turned))}")
    if parent.stiffness_level != child.stiffness_level:
        if child.stiffness_mode == parent.stiffness_mode == "shared":
            changes.append(f"stiffness {parent.stiffness_text} → {child.stiffness_text}")
        elif not moved:
            changes.append("stiffnesses")
    return changes


def _differences(a: list[int], b: list[int]) -> int:
    return sum(x != y for x, y in zip(a, b, strict=True))
