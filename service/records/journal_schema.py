"""The journal's tables, and the steps by which a journal of an earlier version becomes one of this.

Version 2 added what a job was carried out with (its recipe's whole settings, the calibration's hash) and its transfer.
Version 3 added who asked for what from the operator's page. Version 4 added on which serial line a job was
acknowledged, whether its end is still to be told there, and at which controller, how laid out there, it was sent.
Version 5 added what shifts are told by: jobs by time, checks against a master, triggers that were not taken.
"""

from __future__ import annotations

SCHEMA_VERSION = 5

AUDIT = """
CREATE TABLE audit (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    at TEXT NOT NULL,
    who TEXT,
    address TEXT NOT NULL,
    action TEXT NOT NULL,
    detail TEXT,
    result TEXT
) STRICT;
"""

LINE_AND_TARGET = """
ALTER TABLE jobs ADD COLUMN target TEXT;
ALTER TABLE jobs ADD COLUMN line TEXT;
ALTER TABLE jobs ADD COLUMN owed INTEGER NOT NULL DEFAULT 0;
CREATE INDEX jobs_owed ON jobs (job_id) WHERE owed = 1;
"""

SHIFTS = """
CREATE INDEX jobs_by_time ON jobs (taken_at);
CREATE TABLE checks (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    at TEXT NOT NULL,
    kind TEXT NOT NULL CHECK (kind IN ('verify', 'repeat')),
    calibration TEXT NOT NULL,
    pictures INTEGER NOT NULL,
    mean_mm REAL NOT NULL,
    p95_mm REAL NOT NULL,
    worst_mm REAL NOT NULL,
    limit_mm REAL NOT NULL,
    verdict TEXT NOT NULL CHECK (verdict IN ('pass', 'fail'))
) STRICT;
CREATE TABLE missed (
    at TEXT NOT NULL,
    kind TEXT NOT NULL,
    reason TEXT NOT NULL,
    count INTEGER NOT NULL,
    PRIMARY KEY (at, kind, reason)
) STRICT, WITHOUT ROWID;
"""

TABLES = f"""
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT;
CREATE TABLE recipe_settings (digest TEXT PRIMARY KEY, settings TEXT NOT NULL) STRICT;
CREATE TABLE jobs (
    job_id INTEGER PRIMARY KEY CHECK (job_id > 0),
    taken_at TEXT NOT NULL,
    trigger_kind TEXT NOT NULL,
    trigger_session INTEGER,
    trigger_counter INTEGER,
    recipe INTEGER NOT NULL,
    thickness_um INTEGER NOT NULL,
    session INTEGER,
    pages TEXT,
    withdraw_reason INTEGER,
    outcome TEXT CHECK (outcome IN ('accepted', 'written', 'refused', 'failed')),
    reason INTEGER,
    detail TEXT,
    settled_at TEXT,
    report TEXT,
    recipe_digest TEXT,
    calibration TEXT,
    transfer TEXT
) STRICT;
CREATE INDEX jobs_unsettled ON jobs (job_id) WHERE outcome IS NULL;
CREATE INDEX jobs_by_controller ON jobs (job_id) WHERE trigger_counter IS NOT NULL;
{AUDIT}{LINE_AND_TARGET}{SHIFTS}"""

# Each from the version that is its key to the next.
MIGRATIONS = {
    1: """
CREATE TABLE recipe_settings (digest TEXT PRIMARY KEY, settings TEXT NOT NULL) STRICT;
ALTER TABLE jobs ADD COLUMN recipe_digest TEXT;
ALTER TABLE jobs ADD COLUMN calibration TEXT;
ALTER TABLE jobs ADD COLUMN transfer TEXT;
""",
    2: AUDIT,
    3: LINE_AND_TARGET,
    4: SHIFTS,
}

COLUMNS_OF_1 = (
    "job_id, taken_at, trigger_kind, recipe, thickness_um, trigger_session, trigger_counter,"
    " session, pages, withdraw_reason, outcome, reason, detail, settled_at, report"
)
COLUMNS_OF_2 = (
    f"{COLUMNS_OF_1}, (SELECT settings FROM recipe_settings WHERE digest = recipe_digest), calibration, transfer"
)
COLUMNS = f"{COLUMNS_OF_2}, line, target"
UNSETTLED = "outcome IS NULL"


def columns(version: int) -> str:
    """What to select of `jobs` in a journal of this version, for `service.records.journal.job_of`."""
    if version > 3:
        return COLUMNS
    return f"{COLUMNS_OF_2}, NULL, NULL" if version > 1 else f"{COLUMNS_OF_1}, NULL, NULL, NULL, NULL, NULL"


def migration(version: int) -> str | None:
    """The script from `version` to this one, one step after the other; None where there is no way."""
    if not 1 <= version < SCHEMA_VERSION:
        return None
    return "".join(MIGRATIONS[step] for step in range(version, SCHEMA_VERSION))
