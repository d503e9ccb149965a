"""The right panel: the chosen robot, and what of it is replayed. How a robot is drawn is in ``viz.robot``.

Read in this order:

- ``robot_panel``: the panel with the robot's card and its tabs.
- ``replay_source``: what the player plays and draws: the robot, a variant, or those pinned.
- ``what_if_panel``: the robot with another body, simulated on the spot.
- ``pins_panel``: robots to see side by side.
- ``live_panel``: network and servos in step with the replay.
- ``lineage_panel``: the robot's ancestors.
"""
