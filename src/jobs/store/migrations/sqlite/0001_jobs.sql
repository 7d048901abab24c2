-- A job's record is one JSON document; what is searched by is generated from it, so that the two
-- can never differ. The character's bytes come last: a listing never reads their pages.
CREATE TABLE jobs (
    id        TEXT NOT NULL PRIMARY KEY,
    record    TEXT NOT NULL,
    state     TEXT NOT NULL GENERATED ALWAYS AS (json_extract(record, '$.state')) STORED,
    character BLOB NOT NULL
) STRICT;

CREATE INDEX jobs_by_state ON jobs (state, id);

-- The learning curve, one row a generation.
CREATE TABLE generations (
    job        TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    generation INTEGER NOT NULL,
    figures    TEXT NOT NULL,
    PRIMARY KEY (job, generation)
) STRICT, WITHOUT ROWID;

-- Characters kept for later jobs; the same bytes are kept once.
CREATE TABLE characters (
    id       TEXT NOT NULL PRIMARY KEY,
    digest   TEXT NOT NULL UNIQUE,
    findings TEXT NOT NULL,
    bytes    BLOB NOT NULL
) STRICT;
