//! Learns a motion for the bundled quadruped and saves it, with its recording, in the folder `walk`.
//!
//! `cargo run --release --example train`

use std::error::Error;
use std::path::Path;
use std::time::Duration;

use gaitwright::jobs::{Order, Settings, run};
use gaitwright_learning::learn::{Cancel, Learning};
use gaitwright_physics::character::{Options, read_file};

fn main() -> Result<(), Box<dyn Error>> {
    let reading = read_file(Path::new("examples/quadruped.urdf"), Options::default())?;
    let learning = Learning { generations: Some(5), ..Learning::default() };
    let order = Order::new(reading, Settings { learning, ..Settings::default() })?;
    let threads = std::thread::available_parallelism()?.get();
    let (folder, never) = (Path::new("walk"), Cancel::default());
    std::fs::create_dir_all(folder)?;
    let outcome = run(&order, threads, folder, (&never, Duration::MAX), None, &mut ())?;
    println!("walk/motion.json moves at {:.2} m/s", outcome.motion?.speed);
    Ok(())
}
