-- Jobs are of more than one kind, told apart by a field of the record. What a job works on, a character
-- for one kind and a scenario for the other, is its input.
UPDATE jobs SET record = json_set(record, '$.kind', 'learning') WHERE json_extract(record, '$.kind') IS NULL;

ALTER TABLE jobs RENAME COLUMN character TO input;
