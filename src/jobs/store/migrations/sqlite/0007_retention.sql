-- When a character was used last (ms since 1970), and when it goes and why.
ALTER TABLE characters ADD COLUMN used INTEGER NOT NULL DEFAULT 0;
ALTER TABLE characters ADD COLUMN expiry TEXT;

UPDATE characters SET used = CAST(unixepoch('subsec') * 1000 AS INTEGER);
