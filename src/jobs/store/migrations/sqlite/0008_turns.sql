-- The number of the claim whose files are the job's.
ALTER TABLE jobs ADD COLUMN run INTEGER NOT NULL DEFAULT 0;

-- What a caller's waiting jobs of one priority have in common: whose turn it is is decided among these, which are few,
-- and not among the jobs.
ALTER TABLE jobs ADD COLUMN turn TEXT
    GENERATED ALWAYS AS (printf('%02d', 10 - priority) || ' ' || caller) VIRTUAL;

CREATE INDEX jobs_in_turn ON jobs (state, turn, id);
CREATE INDEX jobs_by_caller ON jobs (state, caller);

-- Parts of documents that are asked for.
ALTER TABLE jobs ADD COLUMN digest TEXT
    GENERATED ALWAYS AS (json_extract(record, '$.character.digest')) VIRTUAL;
ALTER TABLE characters ADD COLUMN name TEXT
    GENERATED ALWAYS AS (CASE WHEN json_valid(findings) THEN json_extract(findings, '$.name') END) VIRTUAL;
