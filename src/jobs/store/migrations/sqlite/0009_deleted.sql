-- Jobs that were deleted since the service was last started: files of theirs that are still there may go.
CREATE TABLE deleted (
    id TEXT NOT NULL PRIMARY KEY
) STRICT, WITHOUT ROWID;
