"""A replay in the 3D scene of one browser, and its controls. Nothing here chooses what is played.

Read in this order:

- ``player``: plays a replay while it is simulated; hands on every ``ReplayMoment`` that is due.
- ``stage``: light and floor. ``scene``: draws one robot there. ``robot_drawing``: its body and walls.
  ``target_mark``: its target. ``overlays``: numbers, contacts, trail. ``shapes``:
  what they are built of, and feet.
- ``scene_overlay``: what lies over the scene: ways to look, a line, a still until the robot is there; its
  script is ``scene_overlay.js``.
- ``scene_camera``: shows what matters and follows the robot.
- ``side_by_side``: several replays as one. ``side_by_side_scene``: their lanes in the scene.
- ``transport``: the panel with play, time, trial and overlays; its layout is in ``transport.css``.
- ``replay_line``: the line below it: the moment, and how the trial ended.
- ``ground_picker``: a click on the ground, for a target of one's own.
"""
