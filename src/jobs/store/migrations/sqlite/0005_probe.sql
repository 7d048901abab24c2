-- One row that is written to see whether anything can be.
CREATE TABLE probe (
    id      INTEGER NOT NULL PRIMARY KEY CHECK (id = 1),
    written TEXT NOT NULL
) STRICT;
