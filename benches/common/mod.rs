//! Shared by the benches: characters, targets, and the time of a step.

#![allow(dead_code)] // each bench uses its own part of this

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use gaitwright_physics::character::{self, Options, Source};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::sim::{Command, Simulator};

/// The robot that the variable `ROBOT` names, or the bundled quadruped.
pub fn robot() -> Arc<Model> {
    let bundled = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/quadruped.urdf");
    let path = std::env::var_os("ROBOT").map_or(bundled, PathBuf::from);
    let reading = character::read_file(&path, Options::default()).expect("a readable robot");
    Arc::new(Model::new(Arc::new(reading.character), Base::Floating))
}

/// Length of a chain's links, m.
const LINK: f64 = 0.1;

/// A chain of `links` rods of 0.1 kg and 0.1 m along x, with hinges about y and z in turn; every link whose index
/// is divisible by `feet` has a ball of 5 cm radius that touches the ground.
///
/// Its first link is bolted to the world if `bolted`.
pub fn chain(links: usize, feet: Option<usize>, bolted: bool) -> Arc<Model> {
    let mut urdf = String::from("<robot name=\"chain\">\n");
    for index in 0..links {
        let foot = if feet.is_some_and(|feet| index % feet == 0) {
            "<collision><geometry><sphere radius=\"0.05\"/></geometry></collision>"
        } else {
            ""
        };
        let center = LINK / 2.0;
        writeln!(
            urdf,
            "<link name=\"l{index}\"><inertial><origin xyz=\"{center} 0 0\"/><mass value=\"0.1\"/>\
             <inertia ixx=\"1e-5\" iyy=\"1e-4\" izz=\"1e-4\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>{foot}</link>"
        )
        .expect("text");
        if index > 0 {
            let axis = if index % 2 == 0 { "0 0 1" } else { "0 1 0" };
            let parent = index - 1;
            writeln!(
                urdf,
                "<joint name=\"j{index}\" type=\"continuous\"><parent link=\"l{parent}\"/><child link=\"l{index}\"/>\
                 <origin xyz=\"{LINK} 0 0\"/><axis xyz=\"{axis}\"/></joint>"
            )
            .expect("text");
        }
    }
    urdf.push_str("</robot>");
    let reading = character::read(urdf.as_bytes(), Source::Urdf, Options::default()).expect("a chain");
    Arc::new(Model::new(Arc::new(reading.character), Base::fixed_if(bolted)))
}

/// Targets of `steps` steps of `step` seconds that sway by `amplitude` rad at 1 Hz about `angles`, every
/// third joint excepted.
pub fn sway(angles: &[f64], amplitude: f64, step: f64, steps: usize) -> Vec<Vec<f64>> {
    (0..=steps)
        .map(|index| {
            let sway = amplitude * (std::f64::consts::TAU * index as f64 * step).sin();
            angles.iter().enumerate().map(|(joint, angle)| angle + sway * f64::from(joint % 3 != 0)).collect()
        })
        .collect()
}

/// Whether this is a measurement (`cargo bench`), and not a trial of whether the bench runs (`cargo test`).
pub fn measuring() -> bool {
    std::env::args().any(|argument| argument == "--bench")
}

/// Nanoseconds of one step from `start` along `targets` (see [`Fastest`]), of `rounds` rounds.
pub fn nanoseconds(start: &Simulator, targets: &[Vec<f64>], rounds: usize) -> f64 {
    let mut fastest = Fastest::default();
    fastest.measure(start, targets, rounds);
    fastest.nanoseconds()
}

/// The fastest of many times of every step of a round. A round is interrupted so often that not even the fastest of many shows what
/// its steps take.
#[derive(Default)]
pub struct Fastest {
    steps: Vec<Duration>,
}

impl Fastest {
    /// Measures `rounds` rounds from `start` along `targets`, the same every time.
    pub fn measure(&mut self, start: &Simulator, targets: &[Vec<f64>], rounds: usize) {
        self.steps.resize(targets.len() - 1, Duration::MAX);
        for _ in 0..rounds {
            let mut simulator = start.clone();
            for (pair, fastest) in targets.windows(2).zip(&mut self.steps) {
                let begun = Instant::now();
                simulator.step(Command::Track { now: &pair[0], next: &pair[1] }).expect("a step");
                *fastest = begun.elapsed().min(*fastest);
            }
        }
    }

    /// The mean over the steps, ns, without what it takes to look at the clock.
    pub fn nanoseconds(&self) -> f64 {
        let clock = (0..1000).map(|_| Instant::now().elapsed()).min().unwrap_or_default();
        let whole: Duration = self.steps.iter().sum();
        (whole.as_secs_f64() / self.steps.len() as f64 - clock.as_secs_f64()) * 1e9
    }
}
