-- A worker holds a job by a lease that it renews (ms since 1970), and by the number of its claim, which stands in every
-- change that it makes. Whoever takes the job from it takes the next number.
ALTER TABLE jobs ADD COLUMN worker TEXT;
ALTER TABLE jobs ADD COLUMN lease_until INTEGER;
ALTER TABLE jobs ADD COLUMN fence INTEGER NOT NULL DEFAULT 0;

-- Whose turn it is: who posted the job, how urgent it is, and in which order callers were served last.
ALTER TABLE jobs ADD COLUMN caller TEXT
    GENERATED ALWAYS AS (coalesce(json_extract(record, '$.caller'), '')) VIRTUAL;
ALTER TABLE jobs ADD COLUMN priority INTEGER
    GENERATED ALWAYS AS (CAST(coalesce(json_extract(record, '$.priority'), 0) AS INTEGER)) VIRTUAL;

CREATE TABLE callers (
    caller TEXT NOT NULL PRIMARY KEY,
    served INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
