"""One robot as geometry, SVG and HTML.

What shows a single robot, or compares a few. The panels that hold it are ``app/robot/``, the 3D scene is
``app/replay/``, and a whole replay as a file is ``viz/recording/``.

Read in this order:

1. ``skeleton``: where its rods and cables begin and end, simulated or as built.
2. ``geometry``: the same as it is drawn, with colours, tension and friction, at any moment of a replay.
3. ``framing``: where a camera must be to show it.
4. ``stroke_font``: the numbers of its modules, in the scene.
5. ``robot_card``: its body, origin and scores.
6. ``head_paths``: where its head went, towards all targets.
7. ``network_diagram``: its controller's network, and what the neurons do.
8. ``servo_plot``: what each module is told and does over time.
9. ``tension_legend``: what the colours of the cables and the length of arrows mean.
10. ``lineage_list``: its ancestors.
11. ``robot_differences``: what several robots differ in.
12. ``what_if_table``: a changed body beside the original.
13. ``body_drawing``: a small drawing that a browser makes from the body's faces.
14. ``breeding_strip``: the children of chosen robots, each drawn, with its gain.
"""
