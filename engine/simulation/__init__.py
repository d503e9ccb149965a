"""Genes in, evaluations out. No archive, no file, no screen.

Read in this order:

- ``built``: what a robot is like where it may differ from the published one, and how robots differ.
- ``physics``: what a run can set: friction, contact, inertia, noise, time step.
- ``model``: a body and its walls as a MuJoCo model.
- ``divergence``: which simulations have failed, and their last moments.
- ``senses``: what a controller is told, and where a servo stands: late, noisy, slow.
- ``batch``: many simulations side by side, by MuJoCo.
- ``rollout``: settling, the search for the head, the closed loop of sensing, network and servos, by MuJoCo.
- ``kernel/``: all of this by the product's own kernel: the same physics, much faster.
- ``trials``: the trials of a robot, and the one place where they begin, by the simulator that a run chose.
- ``evaluation``: solutions in, evaluations out.
- ``compile_kernel``: the kernel compiled before anybody waits for it.
- ``provenance``: which computer and versions computed something.
- ``self_check``: a known simulation, repeated to test an installation.
"""
