-- The key under which a job was posted, and a digest of what was posted: the same again is the same job. It goes with
-- the job.
ALTER TABLE jobs ADD COLUMN key TEXT;
ALTER TABLE jobs ADD COLUMN request TEXT;

CREATE UNIQUE INDEX jobs_by_key ON jobs (key) WHERE key IS NOT NULL;
