//! Jobs, learning curves and characters in one SQLite file.
//!
//! | file | holds |
//! |---|---|
//! | `connection` | the file, its one writer and its readers |
//! | `records` | jobs as their clients see them: posted, shown, changed, deleted |
//! | `claims` | jobs as their workers hold them: taken up, renewed, recorded, given back |
//! | `curves` | learning curves |
//! | `characters` | characters kept for later jobs |
//!
//! Every change of a job's state is one transaction that reads the job, decides and writes, so that two who change it
//! at once, threads or machines, do so one after the other. A worker holds a job by a [`Claim`]: a lease that it
//! renews, and a number that grows with every claim and stands in every change that the worker makes. Once the job has
//! passed to another, what the first still writes changes nothing.

mod characters;
mod claims;
mod connection;
mod curves;
mod records;

pub use characters::{CharacterDeletion, StoredCharacter};
pub use claims::{Claim, Claimed, Holding, Reclaimed};
pub use connection::{Store, StoreError};
pub use records::{Amendment, StoredJob};
