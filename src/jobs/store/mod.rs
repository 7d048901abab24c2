//! Jobs, learning curves and characters in a database: one SQLite file, or a PostgreSQL server that any number of
//! processes share.
//!
//! | file | holds |
//! |---|---|
//! | `database` | the database, who writes and who reads |
//! | `dialect` | what the two databases do not say alike |
//! | `news` | what others who share a server do |
//! | `records` | jobs as their clients see them: posted, shown, changed, deleted |
//! | `claims` | jobs as their workers hold them: taken up, renewed, recorded, given back |
//! | `curves` | learning curves |
//! | `characters` | characters kept for later jobs |
//!
//! Every change of a job's state is one transaction that reads the job, decides and writes, so that two who change it
//! at once, threads or machines, do so one after the other: in the file because one writes at a time, on the server
//! because the job's row is locked. A worker holds a job by a [`Claim`]: a lease that it renews, and a number that grows
//! with every claim and stands in every change that the worker makes. Once the job has passed to another, what the first
//! still writes changes nothing.

mod characters;
mod claims;
mod curves;
mod database;
mod dialect;
mod news;
mod records;

pub use characters::{CharacterDeletion, StoredCharacter};
pub use claims::{Claim, Claimed, Holding, Reclaimed};
pub use database::{Store, StoreError};
pub use news::{Happened, Listener};
pub use records::{Amendment, QueueRoom, StoredJob};
