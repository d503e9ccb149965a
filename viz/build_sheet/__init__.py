"""A robot's build sheet: everything that a workshop needs to know about it, as a PDF to print.

The parts, lengths and masses come from ``engine/fabrication/``; here they are put on pages. The same robot
gives the same bytes.

Read in this order:

1. ``sheet``: the list of sections, from which the PDF is made.
2. ``sections/``: what the pages say, a file for each section.
3. ``facts``: what the sections know of the robot.
4. ``style``: paper, fonts, colours, paragraph styles, and how numbers are written.
5. ``blocks``: headings, paragraphs, lists and tables.
6. ``pen``: pictures on a page, and what draws them.
7. ``scene``: tubes and balls in three dimensions, painted with the pen.
8. ``bodies``: a robot as tubes and balls.
9. ``details``: enlarged drawings of a rod's end, of the drum and of a limiter.
10. ``part_drawings``: drawings of the parts with measures, from their solids; ``part_view``: one view.
11. ``document``: pages with header, footer and number, put into a file.
12. ``kit/``: the papers of a kit for one module, and what a robot or a module costs.
"""
