"""The layout of a run file, a SQLite database."""

from __future__ import annotations

from pathlib import Path
from typing import Final

SUFFIX: Final = ".tsmr"

APPLICATION_ID: Final = 0x54534D52
"""``TSMR``: in the header of every run file."""
FORMAT_VERSION: Final = 2
"""Format 1 had neither digests nor origins. A file keeps the format that it was made with until the user asks
for a copy in this one (``engine.storage.migration``).
"""

DIGESTS: Final = """
CREATE TABLE digests (
    number INTEGER PRIMARY KEY,      -- of an evaluation
    digest BLOB NOT NULL             -- of its row, see engine.storage.rows.digest
);
"""

ORIGINS: Final = (
    """
CREATE TABLE computers (
    id INTEGER PRIMARY KEY,
    facts TEXT NOT NULL UNIQUE       -- JSON: architecture, instruction sets, versions
);
""",
    """
CREATE TABLE computed (
    evaluation INTEGER PRIMARY KEY,
    computer INTEGER NOT NULL,
    seconds REAL                     -- CPU time, where it was measured for one evaluation alone
);
""",
)
"""What computed the evaluations, as far as it is known."""

TABLES: Final = (
    DIGESTS
    + "".join(ORIGINS)
    + """
CREATE TABLE meta (
    key TEXT PRIMARY KEY,
    value TEXT NOT NULL              -- JSON
) WITHOUT ROWID;

CREATE TABLE evaluations (
    number INTEGER PRIMARY KEY,      -- counts from 0; the seeds follow from it
    generation INTEGER NOT NULL,
    morphology TEXT NOT NULL,        -- JSON genotype
    controller TEXT NOT NULL,        -- JSON genotype
    parent INTEGER,
    operator TEXT NOT NULL,
    source TEXT,                     -- the archive the parent was drawn from
    fitness REAL,                    -- m, to be minimised; NULL if a simulation failed
    distances TEXT NOT NULL,         -- JSON, targets x repeats, m
    trajectory BLOB NOT NULL,        -- float32 little-endian, targets x seconds x 2, m
    head_is_end INTEGER NOT NULL,
    failure TEXT
);

CREATE TABLE generations (
    generation INTEGER PRIMARY KEY,
    n_evaluations INTEGER NOT NULL,  -- of all generations so far
    n_failed INTEGER NOT NULL,
    archives TEXT NOT NULL,          -- JSON by archive: best f_s, mean f_s, QD score (m), coverage, axes
    finished_at TEXT NOT NULL,
    seconds REAL NOT NULL            -- computing time of the run so far
);

-- What changed in the archives: the elite of a cell is that of its latest row.
CREATE TABLE placements (
    generation INTEGER NOT NULL,
    archive TEXT NOT NULL,
    cell TEXT NOT NULL,              -- "i,j"
    evaluation INTEGER,              -- NULL: the cell became empty
    PRIMARY KEY (archive, cell, generation)
) WITHOUT ROWID;

-- What resuming needs, as of the last generation.
CREATE TABLE state (
    id INTEGER PRIMARY KEY CHECK (id = 1),
    generation INTEGER NOT NULL,
    algorithm TEXT NOT NULL          -- JSON
);
"""
)

COLUMNS: Final = {
    "meta": "key value",
    "evaluations": "number generation morphology controller parent operator source fitness distances"
    " trajectory head_is_end failure",
    "generations": "generation n_evaluations n_failed archives finished_at seconds",
    "placements": "generation archive cell evaluation",
    "state": "id generation algorithm",
}
"""Columns, in their order, of the tables that a run of every format has."""


def failures_folder(path: Path) -> Path:
    """Return the folder beside a run file where the dumps of its failed simulations are kept."""
    return path.with_name(f"{path.stem}.failures")
