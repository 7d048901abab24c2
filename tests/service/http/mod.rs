//! The service, driven from outside: the built program, and `curl` as its client.

mod access;
mod characters;
pub mod client;
mod ends;
mod exports;
mod faults;
mod harm;
mod interface;
mod keeping;
mod kills;
mod life;
mod page;
mod refusals;
mod studies;
mod survival;
mod turns;
mod whole;
mod writes;
