//! How statements differ between the two databases. Most are written once: both number parameters as `$1`, `$2`.

use sqlx::any::AnyArguments;
use sqlx::{Any, AssertSqlSafe};

/// A statement and what it is about.
pub(super) type Query<'q> = sqlx::query::Query<'q, Any, AnyArguments>;

/// Which database.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dialect {
    /// One file, in which one connection writes at a time.
    Sqlite,
    /// A server, in which rows are locked.
    Postgres,
}

impl Dialect {
    /// The statement `text`, in which stand for what is said differently:
    ///
    /// | | |
    /// |---|---|
    /// | `{now}` | ms since 1970, by the database's clock, which all its users share |
    /// | `{lock}` | after a SELECT: nobody else changes these rows before this transaction has ended |
    /// | `{free}` | the same, of the rows that nobody else has locked |
    pub(super) fn query<'q>(self, text: &'static str) -> Query<'q> {
        let words = match self {
            Self::Sqlite => {
                [("{now}", "CAST(unixepoch('subsec') * 1000 AS INTEGER)"), ("{lock}", ""), ("{free}", "")]
            }
            Self::Postgres => [
                ("{now}", "CAST(extract(epoch FROM clock_timestamp()) * 1000 AS BIGINT)"),
                ("{lock}", "FOR UPDATE"),
                ("{free}", "FOR UPDATE SKIP LOCKED"),
            ],
        };
        let text = words.iter().fold(text.to_owned(), |text, (word, said)| text.replace(word, said));
        // Made of constants alone.
        sqlx::query(AssertSqlSafe(text))
    }

    /// What begins a transaction that will write.
    pub(super) fn begin(self) -> &'static str {
        match self {
            // Refused by a connection that is in a transaction already.
            Self::Sqlite => "BEGIN IMMEDIATE",
            Self::Postgres => "BEGIN",
        }
    }
}
