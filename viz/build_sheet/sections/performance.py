"""What the robot does: f_s per target with its spread, and the paths of its head."""

from __future__ import annotations

import math

import numpy as np
from reportlab.lib.colors import HexColor
from reportlab.platypus import Flowable

from engine.tasks import target_offsets, worlds
from engine.tasks.walls import Wall
from viz.build_sheet import blocks, style
from viz.build_sheet.facts import Facts
from viz.build_sheet.pen import Pen, Picture
from viz.build_sheet.style import Paper, signed
from viz.robot.head_paths import Ground, reach, wall_corners

WALL = HexColor("#c9d3de")
PLOT_HEIGHT = 290.0
MOST_WALLS = 12
"""How many walls are listed."""


def pages(facts: Facts, paper: Paper) -> list[Flowable]:
    """Return the section."""
    task, trials = facts.task, facts.config.trials
    start = 100 * task.target_distance
    return [
        blocks.heading("What to expect of it"),
        blocks.body(
            f"In the task “{style.escaped(task.name)}” the robot starts {start:.0f} cm from a target and is"
            f" given {trials.trial_time:g} s. It was tried on {task.n_targets} targets,"
            f" {_times(trials.repeats)} each. <b>f<sub>s</sub> = {signed(100 * facts.f_s, 2)} cm</b> is the"
            " starting distance minus the fitness, which is the mean over the targets of the trials' score"
            f" ({style.escaped(task.score_name)}) plus half of what the worst target lies above that mean."
            " More is better; a robot that stays where it is has about 0."
        ),
        blocks.subheading("Per target, simulated"),
        _targets(facts, paper.inner_width),
        blocks.gap(3),
        blocks.note(_spread_note(facts)),
        *_paths(facts, paper),
        *_differences(facts, paper.inner_width),
    ]


def _differences(facts: Facts, width: float) -> list[Flowable]:
    """Return what differs between the built and the simulated robot, and what each difference costs."""
    twin, found = facts.twin, facts.as_built
    if twin is None or found is None:
        return []
    costs = dict(found.costs)
    rows = [
        [
            style.escaped(d.name),
            style.escaped(d.simulated),
            style.escaped("; ".join(part for part in (d.built, d.spread) if part)),
            f"{d.origin}: {style.escaped(d.source)}",
            signed(-100 * costs[d.key], 1) if d.key in costs else "",
        ]
        for d in sorted(twin.deviations, key=lambda d: -costs.get(d.key, -math.inf))
    ]
    header = ("what differs", "simulated", "built; spread", "known by", "alone (cm)")
    n = len(found.robots.f_s)
    return [
        blocks.subheading("As it would be built"),
        blocks.body(
            f"Simulated {n} times, each time with another robot that is as inexact as tolerances allow:"
            f" f<sub>s</sub> {_cm(found.robots.mean)} ± {_cm(found.robots.deviation)} cm (mean and standard"
            f" deviation), a tenth of them below {_cm(found.worst)} cm; exactly as designed"
            f" {_cm(found.nominal.mean)} cm; as evolved, under the same noise, {_cm(found.evolved.mean)} cm."
            " The last column is what one difference alone changes."
        ),
        blocks.grid(header, rows, blocks.columns(width, 20, 20, 26, 24, 10), right=(4,)),
    ]


def _cm(length: float | None) -> str:
    return "–" if length is None else signed(100 * length, 1)


def _times(repeats: int) -> str:
    return "once" if repeats == 1 else f"{repeats} times with different noise"


def _targets(facts: Facts, width: float) -> Flowable:
    task = facts.task
    start = 100 * task.target_distance
    rows: list[list[str]] = []
    reached = None if facts.as_built is None else facts.as_built.robots.distances
    for name, d in zip(task.target_names, 100 * facts.evaluation.distances, strict=True):
        gained = start - d
        spread = f"± {np.ptp(gained) / 2:.2f}" if len(d) > 1 else "one trial"
        trials = ", ".join(signed(x, 2) for x in gained)
        built = "–" if reached is None else signed(start - 100 * reached[len(rows)], 1)
        rows.append([style.escaped(name), f"{d.mean():.2f}", signed(gained.mean(), 2), spread, trials, built])
    header = (
        "target",
        f"{style.escaped(task.score_name)}, mean (cm)",
        "closer by (cm)",
        "spread over noise seeds (cm)",
        "closer by, each trial (cm)",
        "closer by, as built (cm)",
    )
    return blocks.grid(header, rows, blocks.columns(width, 16, 19, 14, 18, 20, 13), right=(1, 2, 3, 5))


def _spread_note(facts: Facts) -> str:
    number = facts.evaluation.solution.number
    noise = f"{1000 * facts.config.physics.servo_noise:.2f} mm"
    rate = 1 / facts.config.physics.control_period
    text = (
        f"Noise: every commanded cable length errs by {noise} (standard deviation), drawn {rate:.0f} times a"
        " second. "
    )
    mean = None if facts.robust is None else facts.robust.mean(number)
    if facts.robust is not None and mean is not None:
        fresh = 100 * (facts.task.target_distance - facts.robust.fresh(number))
        spread = f" ± {fresh.std(ddof=1):.2f} (standard deviation)" if len(fresh) > 1 else ""
        return (
            text
            + f"Evaluated again {len(fresh)} times under fresh noise the robot had a mean f<sub>s</sub> of"
            f" {signed(fresh.mean(), 2)} cm{spread}, from {signed(fresh.min(), 2)} to"
            f" {signed(fresh.max(), 2)} cm. Expect this, not the recorded figure, which was the best of many."
        )
    return (
        text
        + "This robot was not evaluated again under fresh noise, so part of its f<sub>s</sub> may be luck:"
        " “tensatlas reevaluate” on the run, then exporting again, prints here what to expect."
    )


def _paths(facts: Facts, paper: Paper) -> list[Flowable]:
    recorded = facts.evaluation.trajectory
    text = (
        "Paths of the head as built, seen from above, once a second"
        if path_of(facts) is not recorded
        else "Paths of the head, seen from above, as recorded once a second"
        if recorded.shape[1]
        else "Targets, seen from above. The run file was made smaller and does not hold the paths"
    )
    repeats = facts.config.trials.repeats
    if facts.as_built is not None and path_of(facts) is not recorded:
        repeats *= len(facts.as_built.robots.known)
    mean = f", mean of {repeats} trials" if repeats > 1 and recorded.shape[1] else ""
    # so that they and what is to be set up share a page
    height = 0.68 * PLOT_HEIGHT if _has_walls(facts) else PLOT_HEIGHT
    return [
        blocks.together(
            [
                blocks.subheading(f"{text}{mean}"),
                Picture(paper.inner_width, height, lambda pen: _draw_paths(pen, facts), "paths of the head"),
                blocks.note(
                    "Left the whole task, right the paths alone, larger. The head starts at the origin and"
                    " points to the right (x). Crosses are targets, rings the ends of the paths; the number"
                    " is how much closer the head came to that"
                    " target." + (" Grey: walls." if _has_walls(facts) else "")
                ),
            ]
        ),
        *walls(facts, paper.inner_width),
    ]


def walls(facts: Facts, width: float) -> list[Flowable]:
    """Return what to set up, in the frame of the plots; nothing where there are no walls."""
    rows: list[list[str]] = []
    made = worlds(facts.task, facts.morphology.n_modules)
    for world in dict.fromkeys(made):
        names = [n for n, w in zip(facts.task.target_names, made, strict=True) if w == world]
        for wall in world:
            if wall.is_buried:
                continue
            centre, half = 100 * np.array(wall.centre), 100 * np.array(wall.half_size)
            ends = [f"{signed(c - h, 1)} to {signed(c + h, 1)}" for c, h in zip(centre, half, strict=True)]
            turn = f"{signed(math.degrees(wall.yaw), 1)}°" if wall.yaw else "none"
            top = f"{centre[2] + half[2]:.1f}"
            rows.append([style.escaped(", ".join(names)), ends[0], ends[1], top, turn])
    if not rows:
        return []
    header = ("for the target", "ahead, x (cm)", "left, y (cm)", "top above the floor (cm)", "turned")
    more = len(rows) - MOST_WALLS
    note = "Smooth boards that do not move; x and y before a board is turned about its middle, to the left."
    if more > 0:
        note += f" {more} more are in robot.xml."
    return [
        blocks.together(
            [
                blocks.subheading("Walls to set up"),
                blocks.grid(header, rows[:MOST_WALLS], blocks.columns(width, 26, 20, 20, 20, 14)),
                blocks.gap(2),
                blocks.note(note),
            ]
        )
    ]


def _reached(facts: Facts) -> np.ndarray:
    """Return the (targets,) distances in m that go with ``path_of``."""
    built = None if facts.as_built is None else facts.as_built.robots.distances
    recorded = path_of(facts) is facts.evaluation.trajectory
    return facts.evaluation.distances.mean(axis=1) if recorded or built is None else built


def path_of(facts: Facts) -> np.ndarray:
    """Return the (targets, seconds, 2) paths to draw, in m: as built, or as recorded if that is not known."""
    recorded = facts.evaluation.trajectory
    if facts.as_built is None or not recorded.shape[1]:
        return recorded
    built = facts.as_built.robots.trajectory
    return recorded if built is None else built


def _has_walls(facts: Facts) -> bool:
    return any(not w.is_buried for world in worlds(facts.task, facts.morphology.n_modules) for w in world)


def _draw_paths(pen: Pen, facts: Facts) -> None:
    made = worlds(facts.task, facts.morphology.n_modules)
    distinct = list(dict.fromkeys(made))
    groups = [[k for k, w in enumerate(made) if w == world] for world in distinct]
    # every world that differs from the others has a plot of its own, the paths alone share one
    wide = pen.width / 2 if len(groups) == 1 else pen.width * 0.31
    high = pen.height / max(1, math.ceil(len(groups) / 2)) if len(groups) > 2 else pen.height
    for k, (group, world) in enumerate(zip(groups, distinct, strict=True)):
        row, column = divmod(k, 2)
        shift = (column * wide, pen.height - (row + 1) * high)
        _draw_plot(pen, facts, group, world, (*shift, wide, high), targets_too=True)
    left = wide * min(len(groups), 2)
    every = list(range(facts.task.n_targets))
    room = (left, 0.0, pen.width - left, pen.height)
    if facts.evaluation.trajectory.shape[1]:
        _draw_plot(pen, facts, every, (), room, targets_too=False)


def _draw_plot(
    pen: Pen,
    facts: Facts,
    targets: list[int],
    walls: tuple[Wall, ...],
    room: tuple[float, float, float, float],
    *,
    targets_too: bool,
) -> None:
    """Draw the paths towards some targets into a room: left, bottom, width and height in points."""
    *corner, width, height = room
    pen.canvas.saveState()
    pen.canvas.translate(*corner)
    offsets = 100 * target_offsets(facts.task)[targets]
    path = 100 * path_of(facts).astype(float)[targets]
    standing = [w for w in walls if not w.is_buried]
    corners = [100 * wall_corners(w) for w in standing]
    shown, border = reach(offsets, path, targets_too=targets_too)
    left, bottom = 30.0, 24.0
    ground = Ground.fitting(shown, border, (left, bottom), (width - left - 8, height - bottom - 4))
    low, high, scale, at = ground.low, ground.high, ground.scale, ground.at
    _axes(pen, ground)
    c = pen.canvas
    c.saveState()
    clip = c.beginPath()
    clip.rect(*at(low), *(scale * (high - low)))
    c.clipPath(clip, stroke=0)
    for shape in corners:
        pen.path([at(p) for p in shape], fill=WALL, stroke=style.SOFT, close=True)
    x, y = at((0, 0))
    pen.line((x - 14, y), (x - 3, y), color=style.SOFT, width=3)
    pen.path([(x + 5, y), (x - 4, y + 4), (x - 4, y - 4)], fill=style.SOFT, stroke=None, close=True)
    for k, target in enumerate(targets):
        color = style.PATHS[target % len(style.PATHS)]
        points = np.concatenate([np.zeros((1, 2)), path[k]])
        if len(points) > 1:
            pen.path([at(p) for p in points], stroke=color, width=1.4)
            pen.disc(at(points[-1]), 2.8, fill=None, stroke=color, width=1.2)
        if not targets_too:
            continue
        x, y = at(offsets[k])
        for a, b in ((3.5, 3.5), (3.5, -3.5)):
            pen.line((x - a, y - b), (x + a, y + b), color=color, width=1.6)
    c.restoreState()
    for k, target in enumerate(targets if targets_too else ()):
        x, y = at(offsets[k])
        gained = 100 * (facts.task.target_distance - _reached(facts)[target])
        name = f"{facts.task.target_names[target]}: {signed(gained, 1)} cm"
        inside = x < width - 100
        pen.text(
            x + 7 if inside else x - 7,
            y - 3,
            name,
            align="left" if inside else "right",
            color=style.PATHS[target % len(style.PATHS)],
            halo=True,
        )
    pen.canvas.restoreState()


def _axes(pen: Pen, ground: Ground) -> None:
    low, high, at, step = ground.low, ground.high, ground.at, ground.step(24)
    decimals = 0 if step >= 1 else 1
    for axis in (0, 1):
        for value in ground.lines(axis, step):
            a, b = np.array(low), np.array(high)
            a[axis] = b[axis] = value
            pen.line(at(a), at(b), color=style.RULE, width=0.7 if value == 0 else 0.35)
            x, y = at(a)
            if axis == 0:
                pen.text(x, y - 10, signed(value, decimals), align="centre", size=7.5, color=style.SOFT)
            else:
                pen.text(x - 4, y - 2.7, signed(value, decimals), align="right", size=7.5, color=style.SOFT)
    x, y = at((low + high) / 2)
    pen.text(x, at(low)[1] - 20, "ahead, x (cm)", align="centre", size=8, color=style.SOFT)
    pen.text(
        at(low)[0] - 22 - 7 * decimals,
        y,
        "left, y (cm)",
        align="centre",
        size=8,
        color=style.SOFT,
        upright=True,
    )
    lower, upper = at(low), at(high)
    pen.box(lower[0], lower[1], upper[0] - lower[0], upper[1] - lower[1], stroke=style.SOFT)
