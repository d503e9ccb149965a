"""Genes in, evaluations out. No archive, no file, no screen.

Read in this order:

- ``physics``: what a run can set: friction, contact, inertia, noise, time step.
- ``model``: a body and its walls as a MuJoCo model.
- ``batch``: many simulations side by side, by MuJoCo. ``kernel/``: the same physics, much faster.
- ``divergence``: which of them have failed, and their last moments.
- ``rollout``: settling, the search for the head, the closed loop of sensing, network and servos.
- ``trials``: the trials of a robot, and the one way in which they begin.
- ``evaluation``: solutions in, evaluations out.
- ``provenance``: which computer and versions computed something.
- ``self_check``: a known simulation, repeated to test an installation.
"""
