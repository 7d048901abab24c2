//! The service, driven from outside: the built program, and `curl` as its client.

mod access;
mod callers;
mod characters;
pub mod client;
mod damaged;
mod ends;
mod exports;
mod faults;
mod figures;
mod harm;
mod interface;
mod keeping;
mod kills;
mod life;
mod page;
mod refusals;
mod repertoire;
mod studies;
mod survival;
mod turns;
pub mod whole;
mod writes;
