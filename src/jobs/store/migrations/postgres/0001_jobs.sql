-- The tables of SQLite's migrations together; what each column is for stands there. Texts are compared byte by byte, as
-- there.
CREATE TABLE jobs (
    id          TEXT COLLATE "C" NOT NULL PRIMARY KEY,
    record      TEXT NOT NULL,
    state       TEXT COLLATE "C" NOT NULL GENERATED ALWAYS AS (record::json ->> 'state') STORED,
    caller      TEXT COLLATE "C" GENERATED ALWAYS AS (coalesce(record::json ->> 'caller', '')) STORED,
    turn        TEXT COLLATE "C" GENERATED ALWAYS AS (
        lpad((10 - coalesce((record::json ->> 'priority')::int, 0))::text, 2, '0')
            || ' ' || coalesce(record::json ->> 'caller', '')) STORED,
    digest      TEXT COLLATE "C" GENERATED ALWAYS AS (record::json -> 'character' ->> 'digest') STORED,
    unwanted    BIGINT NOT NULL DEFAULT 0,
    key         TEXT COLLATE "C" UNIQUE,
    request     TEXT,
    worker      TEXT,
    lease_until BIGINT,
    fence       BIGINT NOT NULL DEFAULT 0,
    run         BIGINT NOT NULL DEFAULT 0,
    input       BYTEA NOT NULL
);

CREATE INDEX jobs_by_state ON jobs (state, id);
CREATE INDEX jobs_in_turn ON jobs (state, turn, id);
CREATE INDEX jobs_by_caller ON jobs (state, caller);

CREATE TABLE generations (
    job        TEXT COLLATE "C" NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    generation BIGINT NOT NULL,
    figures    TEXT NOT NULL,
    PRIMARY KEY (job, generation)
);

CREATE TABLE callers (
    caller TEXT COLLATE "C" NOT NULL PRIMARY KEY,
    served BIGINT NOT NULL
);

CREATE TABLE characters (
    id       TEXT COLLATE "C" NOT NULL PRIMARY KEY,
    digest   TEXT COLLATE "C" NOT NULL UNIQUE,
    findings TEXT NOT NULL,
    name     TEXT GENERATED ALWAYS AS (findings::json ->> 'name') STORED,
    used     BIGINT NOT NULL,
    expiry   TEXT,
    bytes    BYTEA NOT NULL
);

CREATE TABLE probe (
    id      BIGINT NOT NULL PRIMARY KEY CHECK (id = 1),
    written TEXT NOT NULL
);
