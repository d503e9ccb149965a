"""The shapes of a robot's parts, and their files: meshes to print, drawings of the nets, the whole robot.

Solids are in mm, as their files are; every other length is in m. Lists, masses and checks of parts lie
in the room above. Read in this order:

- ``solids``: boxes, bars and cylinders to build parts from, and the measure of thin walls.
- ``mesh_files``: solids as STL and 3MF.
- ``net``: the 24 cables of a module unfolded into one flat net, and how many are cut from which sheet.
- ``cams``: outlines that wind the internal cables nearly as the published table says.
- ``drum``: the servo's drum, made of such cams.
- ``servo_parts``: the servo's mount, the guide of its lines and the counterweight.
- ``head_tag``: what carries the tag by which a camera sees the head.
- ``shapes``: the solids of nets, caps, links and the coupon.
- ``foot``: a foot that grips one way, and the sled of its friction test.
- ``net_files``: what is cut from a sheet as drawings at 1:1, DXF and SVG.
- ``printed_parts``: which of these a robot needs, how many, of what, and whether they can be printed.
- ``assembly``: the whole robot as one GLB scene, and the room that the servo has.
"""
