//! The program from outside: commands, the service, files; and the structure of the whole.

mod accuracy;
mod browser;
mod cli;
#[path = "../common/mod.rs"]
mod common;
mod damage;
mod exports;
mod full_disk;
mod gait;
mod guide;
mod http;
mod jobs;
mod machines;
mod motion;
mod playback;
mod python;
mod readers;
mod recording;
mod settings;
mod structure;
mod study;
#[path = "../common/synthetic.rs"]
mod synthetic;
#[path = "../common/tables.rs"]
mod tables;
mod teaching;
