"""Numbers become something to look at: SVG, HTML, pictures, videos, PDFs. Imports engine, never app.

Nothing here simulates, changes a run or knows who is looking. A function takes data and returns a picture; a
click is JavaScript that the caller hands in.

The rooms. ``maps``, ``robot`` and ``runs`` import only ``theme`` and ``words``, the others these three too:

* ``theme``: the colours that everything is drawn with. ``words``: the sentences that explain it.
* ``maps/``: the cells of archives as maps.
* ``robot/``: one robot as geometry, diagrams and tables.
* ``runs/``: runs as lists and trends.
* ``recording/``: a replay as a picture, a video or a page.
* ``report/``: a comparison of runs as a page with figures.
* ``build_sheet/``: what a workshop needs to build a robot, as a PDF.
"""
