"""The layout of a run file, a SQLite database; ``docs/run-file.md`` has it byte by byte."""

from __future__ import annotations

from pathlib import Path
from typing import Final

SUFFIX: Final = ".tsmr"

APPLICATION_ID: Final = 0x54534D52
"""``TSMR``: in the header of every run file."""
FORMAT_VERSION: Final = 3
"""Format 1 had neither digests nor origins, format 2 digests of evaluations alone and no compressed columns.
A file keeps the format that it was made with until the user asks for a copy in this one
(``engine.storage.migration``).
"""

TABLES: Final = """
CREATE TABLE meta (
    key TEXT PRIMARY KEY,
    value TEXT NOT NULL              -- JSON; of the key "digest": that of all others
) WITHOUT ROWID;

-- How many rows other tables have and the last of others, so that none is lost unnoticed.
CREATE TABLE totals (
    id INTEGER PRIMARY KEY CHECK (id = 1),
    n_evaluations INTEGER NOT NULL,
    n_details INTEGER NOT NULL,
    n_states INTEGER NOT NULL,
    n_computers INTEGER NOT NULL,
    last_generation INTEGER,         -- NULL before the first is closed
    digest BLOB NOT NULL
);

CREATE TABLE evaluations (
    number INTEGER PRIMARY KEY,      -- counts from 0; the seeds follow from it
    generation INTEGER NOT NULL,
    morphology TEXT NOT NULL,        -- stiffness level / faces: "8/24336"; or a level for each: "8,3,10/243"
    parent INTEGER,
    operator TEXT NOT NULL,
    source TEXT,                     -- the archive the parent was drawn from
    fitness REAL,                    -- m, to be minimised; NULL if a simulation failed
    head_is_end INTEGER NOT NULL,
    failure TEXT,
    computer INTEGER,                -- that evaluated it, if that is known
    microseconds INTEGER,            -- CPU time, where it was measured for one evaluation alone
    digest BLOB NOT NULL
);

-- What is only needed of a robot that is looked at or gone on from.
CREATE TABLE details (
    number INTEGER PRIMARY KEY,      -- of the evaluation
    base INTEGER,                    -- an older evaluation: the controller is stored as changes of its
    controller BLOB NOT NULL,        -- engine.storage.layouts.controllers
    distances BLOB NOT NULL,         -- number of targets, then float64 by target and repeat, m
    trajectory BLOB NOT NULL,        -- engine.storage.layouts.trajectories
    digest BLOB NOT NULL
);

CREATE TABLE generations (
    generation INTEGER PRIMARY KEY,
    n_evaluations INTEGER NOT NULL,  -- of all generations so far
    n_failed INTEGER NOT NULL,
    archives BLOB NOT NULL,          -- deflated JSON: best and mean f_s, QD score (m), coverage, axes of each
    finished_at TEXT NOT NULL,
    seconds REAL NOT NULL,           -- computing time of the run so far
    placed BLOB NOT NULL,            -- digest of the generation's rows of placements
    digest BLOB NOT NULL             -- of the row and of the digest before it
);

-- What changed in the archives: the elite of a cell is that of its latest row.
CREATE TABLE placements (
    generation INTEGER NOT NULL,
    archive TEXT NOT NULL,
    cell TEXT NOT NULL,              -- "i,j"
    evaluation INTEGER,              -- NULL: the cell became empty
    PRIMARY KEY (generation, archive, cell)
) WITHOUT ROWID;

-- What resuming needs, as of the last generation.
CREATE TABLE state (
    id INTEGER PRIMARY KEY CHECK (id = 1),
    generation INTEGER NOT NULL,
    algorithm BLOB NOT NULL,         -- deflated JSON
    digest BLOB NOT NULL
);

CREATE TABLE computers (
    id INTEGER PRIMARY KEY,
    facts TEXT NOT NULL UNIQUE,      -- JSON: architecture, instruction sets, versions
    n_evaluations INTEGER NOT NULL,  -- that it computed
    digest BLOB NOT NULL
);
"""

_FIRST: Final = {
    "meta": "key value",
    "evaluations": "number generation morphology controller parent operator source fitness distances"
    " trajectory head_is_end failure",
    "generations": "generation n_evaluations n_failed archives finished_at seconds",
    "placements": "generation archive cell evaluation",
    "state": "id generation algorithm",
}
COLUMNS: Final = {
    1: _FIRST,
    # its other tables, computers and computed, came later within the format
    2: _FIRST | {"digests": "number digest"},
    3: {
        "meta": "key value",
        "totals": "id n_evaluations n_details n_states n_computers last_generation digest",
        "evaluations": "number generation morphology parent operator source fitness head_is_end failure"
        " computer microseconds digest",
        "details": "number base controller distances trajectory digest",
        "generations": "generation n_evaluations n_failed archives finished_at seconds placed digest",
        "placements": "generation archive cell evaluation",
        "state": "id generation algorithm digest",
        "computers": "id facts n_evaluations digest",
    },
}
"""Columns, in their order, of the tables that every run of a format has."""
KNOWN_TABLES: Final = {"computed", "computers"}.union(*COLUMNS.values())
"""Tables that a run of any format may have."""


def failures_folder(path: Path) -> Path:
    """Return the folder beside a run file where the dumps of its failed simulations are kept."""
    return path.with_name(f"{path.stem}.failures")
