use gaitwright_learning::program::{gaits::named, refine::Subject, ring::*, template::stride};
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::stance::Stance;
use std::sync::Arc;
fn main() {
    let path = std::path::PathBuf::from(std::env::var("ROBOT").unwrap());
    let reading = gaitwright_physics::character::read_file(&path, Default::default()).unwrap();
    let model = Arc::new(gaitwright_physics::model::Model::new(
        Arc::new(reading.character),
        gaitwright_physics::model::Base::Floating,
    ));
    let scene = Scene::default();
    let stance = Arc::new(Stance::find(&model, &scene));
    let subject = Subject::new(&model, &stance, &scene, &Accuracy::default(), [1.0, 0.0, 0.0]).unwrap();
    let legs = &subject.legs;
    for leg in &legs.legs {
        println!(
            "hip {:?} foot {:?} len {} r {} standing ext {} angles {:?}",
            leg.hip,
            leg.foot,
            leg.length,
            leg.radius,
            leg.extension(&leg.standing),
            leg.standing
        );
    }
    println!("hip height {}", legs.hip_height);
    for (g, fr) in [("walk", 0.1), ("trot", 0.4), ("pace", 0.4)] {
        let wanted = Wanted::at_froude(legs, named(g, legs).unwrap(), fr, 9.81);
        for ext in [0.0, 2.0, -2.0] {
            for per in [0.0, -2.0] {
                let mut p = vec![0.0; PARAMETERS];
                p[EXTENSION] = ext;
                p[PERIOD] = per;
                let prog = program(legs, &wanted, &p);
                let m = stride(legs, &prog, 9.81);
                let mut out = vec![];
                for (i, leg) in legs.legs.iter().enumerate() {
                    let s = ((prog.steps[i].phase + 0.5 * prog.steps[i].duty).rem_euclid(1.0) * 64.0)
                        as usize
                        % 64;
                    let mut a = leg.standing.clone();
                    let left = leg.reach(&mut a, m[s].feet[i], nalgebra::Vector3::z());
                    out.push(format!("{:.3}({:.4})", leg.extension(&a), left));
                }
                let (ring, gains) = subject.ring(&wanted, &p);
                let f = subject.arena().unwrap().run(&ring, &gains, false, 5);
                println!(
                    "{g} ext {ext} per {per}: period {:.3} planned mid {:?} raise {:.3} missed {:.4} -> upright {} v {:.2}/{:.2} CoT {:.3} slip {:.3} duty {:?} ext {:?} peak {:?} smooth {:.3} irr {:.3}",
                    prog.period,
                    out,
                    prog.raise,
                    ring.missed,
                    f.upright,
                    f.speed,
                    wanted.speed,
                    f.cost_of_transport,
                    f.slip,
                    f.legs.iter().map(|l| (l.duty * 100.0).round() / 100.0).collect::<Vec<_>>(),
                    f.legs.iter().map(|l| (l.extension * 1000.0).round() / 1000.0).collect::<Vec<_>>(),
                    f.legs.iter().map(|l| (l.peak * 100.0).round() / 100.0).collect::<Vec<_>>(),
                    f.smoothness,
                    f.irregular
                );
            }
        }
    }
}
