//! Several servers and workers over one store: PostgreSQL, and an object store for files. What they need is named where a
//! test is left out for want of it.

mod cluster;
mod everywhere;
mod faults;
mod forwarder;
mod objects;
pub mod postgres;
mod results;
