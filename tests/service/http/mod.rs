//! The service, driven from outside: the built program, and `curl` as its client.

mod access;
mod callers;
mod characters;
mod client;
mod damaged;
mod ends;
mod exports;
mod faults;
mod figures;
mod interface;
mod life;
mod refusals;
mod studies;
mod survival;
mod turns;
