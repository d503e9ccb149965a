"""The run file: its layout, one writer, many readers, repair. A run is locked here.

Files may come from strangers: what is read is checked, and nothing is unpickled. Read in this order:

- ``schema``: the tables, the format's version, the names of files beside a run.
- ``layouts/``: how each format holds a run in its tables.
- ``rows``: generations, summaries and ancestors, which are read without controllers.
- ``lock``: which process writes a run.
- ``raw``: a file's bytes, without opening it here. ``database``: opens a run file to read it.
- ``rescue``: what if the file is removed while it is written. ``writer``: the one process that writes it.
- ``reader``: what it holds, finished or live.
- ``check``: finds what is wrong with a file. ``migration``: a copy of an older format in the present one.
- ``salvage``, ``salvaged_tables``: what is left of a damaged file. ``recovery``: a new
  file from that. A run that was merely killed is resumed (``engine.runs``), not recovered.
"""
