-- As SQLite's ninth.
CREATE TABLE deleted (
    id TEXT COLLATE "C" NOT NULL PRIMARY KEY
);
