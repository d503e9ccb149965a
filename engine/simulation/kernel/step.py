"""Time steps of all lanes, for compiled code (``advance``) and for Python (``run``)."""

from __future__ import annotations

from engine.simulation.kernel.guard import judge
from engine.simulation.kernel.lanes.bare import bare
from engine.simulation.kernel.lanes.compiling import compiled, entry_point, inlined
from engine.simulation.kernel.lanes.simd import any_lane, load, store
from engine.simulation.kernel.physics.feet import find_forward
from engine.simulation.kernel.physics.ground import touch_ground
from engine.simulation.kernel.physics.links import find_links
from engine.simulation.kernel.physics.motion import free_motion, integrate
from engine.simulation.kernel.physics.rod_contacts import MARGIN, find_pairs, search_pairs
from engine.simulation.kernel.physics.solver import solve
from engine.simulation.kernel.physics.state import N_NEAR, N_NEAR_WALLS, State
from engine.simulation.kernel.physics.walls import forget_walls, search_walls, touch_wall
from engine.simulation.kernel.robots.model import Model


@compiled
def advance(model: Model, state: State, n_steps: int) -> None:
    """Move all simulations that go on by a number of time steps, with the same commands."""
    _advance(bare(model), bare(state), n_steps)


@compiled
def _advance(model: Model, state: State, n_steps: int) -> None:
    for _ in range(n_steps):
        free_motion(model, state)
        if model.n_footed:
            find_forward(model, state)
        _search(model, state)
        _find_contacts(model, state)
        find_links(model, state)
        find_pairs(model, state)
        solve(model, state)
        integrate(model, state)


@entry_point
def run(model: Model, state: State, n_steps: int) -> None:
    """Do what ``advance`` does, called from Python, and then judge; other threads may run meanwhile."""
    advance(model, state, n_steps)
    judge(model, state)


@inlined
def _search(model: Model, state: State) -> None:
    """Search for what is near, if something else may be near by now than at the last search."""
    counts, moved = state.work.counts, state.work.moved
    # both of two rods may have moved
    if counts[N_NEAR] < 0 or any_lane(2.0 * load(moved, 0) >= MARGIN):
        search_pairs(model, state)
        if state.n_walls:
            search_walls(model, state)
        store(moved, 0, 0.0)


@inlined
def _find_contacts(model: Model, state: State) -> None:
    """List the contacts with ground and walls, island by island and place by place."""
    start, islands = state.work.contact_start, model.islands
    counts, near_walls = state.work.counts, state.work.near_walls
    n = near = 0
    for i in range(2 * model.n_islands):
        start[i] = n
        k = islands[i]
        if k < 0:
            continue
        n = touch_ground(model, state, k, n)
        while near < counts[N_NEAR_WALLS] and near_walls[2 * near] == k:
            n = touch_wall(model, state, k, near_walls[2 * near + 1], n)
            near += 1
    start[2 * model.n_islands] = n
    if state.n_walls:
        forget_walls(model, state)
