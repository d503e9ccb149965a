"""The product's own physics: robots of free rods and straight cables on a plane, between boxes.

MuJoCo compiles the model and is the reference; friction and all other numbers come from
``simulation.physics`` by way of that model. docs/physics.md says how the two agree and how much faster
the kernel is.
Read in this order:

- ``lanes/``: vectors whose lanes hold simulations.
- ``robots/``: the robots in the lanes.
- ``physics/``: the parts of one time step.
- ``guard``: which simulations have diverged.
- ``step``: as many time steps as wanted.
- ``loop/``: the closed loop of sensing, network, servos and noise, inside compiled code.
- ``batch``: simulations of robots of one size, stepped from Python.
- ``threads``: vectors shared by threads.
- ``settling``: robots dropped, settled and searched for their heads.
- ``simulations``: what observers see. ``rollout``: trials, with the interface of ``simulation.rollout``.

Each lane of a SIMD vector (``simd``) holds one simulation; the robots in a vector have one size.
What compiled code passes around:

``model``: a named tuple (``model.Model``) of the numbers that all lanes' robots share and vectors of those in
which they differ; fields that others need are ``n_modules`` and ``timestep``.

``state``: a named tuple (``state.State``) of one-dimensional arrays of vectors, neighbours in memory are
lanes (``simd.by_lane(array)`` is the same memory with the lanes as a last axis, for Python):

``state.rods``
    13 x rods reals. Rod r of module m is number k = 6 m + r and starts at 13 k: centre x, y, z in m (0 to 2);
    orientation as a unit quaternion w, x, y, z (3 to 6); velocity of the centre in m/s in the world (7 to 9);
    angular velocity in rad/s in the rod's own frame (10 to 12).
``state.commanded``
    5 x modules reals: commanded lengths of the internal cables in m, cable c of module m at 5 m + c. The
    caller writes them before ``advance``.
``state.failed``
    One vector of integers: 0 in the lane of a simulation that goes on, else one of ``guard``'s codes.
    ``advance`` leaves such a lane as it is.

A state also has the forces of the last step, with which the next step's solver begins, and each lane's
walls (``walls.place_walls``). ``state.save`` and ``state.restore`` move a simulation, bits and all, from
a lane to any other with the same robot. After writing ``state.rods`` in another way, call ``state.forget``.

``guard.read_robot`` reads a robot, ``model.model_of`` makes a model of the robots of all lanes and
``state.new_state`` their state. ``step.advance(model, state, n_steps)`` is
a jitted function that moves all lanes on by ``n_steps`` time steps. After each control update
``guard.judge(model, state)``, jitted too, sets ``state.failed`` of lanes that have diverged. Both can be
called from compiled code; neither allocates. The outermost function, which Python calls, is decorated
with ``compiling.entry_point``, which keeps it on disk: ``step.run`` advances and judges,
``batch.KernelBatch`` is what Python sees of them.

For one version of this code, Numba and LLVM, a simulation's bits depend on nothing but its robot, its
walls, its state and its commands: not on the number of lanes, nor on which robots the others hold, nor on
threads, nor on the processor's instructions. What would be needed on ARM: nothing but lanes of two; no
instruction that x86-64 alone has is asked for.
"""
