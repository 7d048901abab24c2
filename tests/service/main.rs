//! The program from outside: commands, the service, files; and the structure of the whole.

mod accuracy;
mod cli;
#[path = "../common/mod.rs"]
mod common;
mod exports;
mod gait;
mod guide;
mod http;
mod motion;
mod playback;
mod readers;
mod recording;
mod structure;
mod study;
#[path = "../common/synthetic.rs"]
mod synthetic;
#[path = "../common/tables.rs"]
mod tables;
