//! Measures what accuracy costs for a robot that is dropped, and asks for the cheapest setting within a millimetre.
//!
//! `cargo run --release -p gaitwright-learning --example accuracy`

use std::error::Error;

use gaitwright_learning::accuracy::{Pieces, Sweep, study};
use gaitwright_learning::scenario::{NoFiles, Scenario};
use serde_json::json;

fn main() -> Result<(), Box<dyn Error>> {
    let drop = json!({
        "character": { "urdf": std::fs::read_to_string("examples/quadruped.urdf")? },
        "start": { "root": { "position": [0, 0, 0.6] } },
        "drive": { "kind": "hold", "feedforward": "none" },
    });
    let setup = Scenario::parse(drop.to_string().as_bytes())?.set_up(&NoFiles)?;
    let sweep = Sweep { steps: vec![8e-3, 2e-3, 5e-4], step_tolerances: vec![1e-2, 1e-4, 1e-6], repeats: 3 };
    let pieces = Pieces { count: 4, finest: 5e-4, finer: 16.0, ..Pieces::default() };
    let table = study("a drop", &setup, &pieces, &sweep, &mut ())?.ok_or("the study was ended")?;
    print!("{}", table.to_csv());
    println!("{:#?}", table.recommend(1e-3));
    Ok(())
}
