//! Poses from which the search for a standing pose begins once more: limbs bent in one way or another.

use nalgebra::Vector3;

use super::anatomy::{Limb, Posed};
use crate::model::{DofKind, Model};

/// How far limbs that lie flat are folded, rad.
const FOLD: f64 = 1.2;

/// How far others are bent, rad.
const BENDS: [f64; 4] = [-0.8, -0.4, 0.4, 0.8];

/// Axes are parallel from this cosine of the angle between them on.
const PARALLEL: f64 = 0.9;

/// `start` with each limb bent down at one joint, the same of all of them, for every joint that can.
pub fn folded(model: &Model, limbs: &[Limb], start: &[f64]) -> Vec<Vec<f64>> {
    let height =
        |angles: &[f64], limb: &Limb| Posed::new(model, angles).foot(limb).map_or(0.0, |foot| foot.z);
    let longest = limbs.iter().map(|limb| limb.bodies.len()).max().unwrap_or(0);
    let bent_at = |place: usize| {
        let mut angles = start.to_vec();
        for limb in limbs {
            let Some(joint) = limb.bodies.get(place).map(|body| body - 1) else { continue };
            let bent = [-FOLD, FOLD].map(|fold| {
                let angle = model.limits[joint]
                    .map_or(start[joint] + fold, |[lower, upper]| (start[joint] + fold).clamp(lower, upper));
                let mut alone = start.to_vec();
                alone[joint] = angle;
                (height(&alone, limb), angle)
            });
            let (down, angle) = if bent[0].0 < bent[1].0 { bent[0] } else { bent[1] };
            if down < height(start, limb) {
                angles[joint] = angle;
            }
        }
        angles
    };
    (0..longest).map(bent_at).collect()
}

/// `start` with each limb bent at a joint like a knee, either way and by different angles: by the same angle, and about the same
/// direction where the axes of alike limbs are opposed, as those of left and right legs often are.
pub fn bent(model: &Model, limbs: &[Limb], start: &[f64]) -> Vec<Vec<f64>> {
    let drawn = Posed::new(model, &vec![0.0; model.joint_count()]);
    let longest = limbs.iter().map(|limb| limb.bodies.len()).max().unwrap_or(0);
    let mut starts: Vec<Vec<f64>> = Vec::new();
    for place in 1..longest {
        let knees: Vec<Knee> = limbs.iter().filter_map(|limb| Knee::of(model, &drawn, limb, place)).collect();
        for bend in BENDS {
            for about_the_same in [false, true] {
                let mut angles = start.to_vec();
                for knee in &knees {
                    let opposed = about_the_same && knee.axis.dot(&knees[0].axis) < 0.0;
                    for &(joint, share) in &knee.turns {
                        let angle = start[joint] + share * if opposed { -bend } else { bend };
                        angles[joint] =
                            model.limits[joint].map_or(angle, |[lower, upper]| angle.clamp(lower, upper));
                    }
                }
                if angles != start && !starts.contains(&angles) {
                    starts.push(angles);
                }
            }
        }
    }
    starts
}

/// A joint of a limb that turns against one before it about the same axis.
struct Knee {
    /// Its axis, root upright, with every joint at zero.
    axis: Vector3<f64>,
    /// Joints, and how far each turns when the limb is bent by one: that before it back, the knee by two, which keeps the limb's end
    /// below its beginning, and one about the same axis behind it, where there is one, back, which keeps a sole level.
    turns: Vec<(usize, f64)>,
}

impl Knee {
    /// The joint in this place of `limb`, if it is such.
    fn of(model: &Model, drawn: &Posed, limb: &Limb, place: usize) -> Option<Self> {
        let axis = |body: usize| drawn.bodies.at(body).rotation * model.bodies[body].axis;
        let knee = *limb.bodies.get(place)?;
        let along = |body: usize| axis(body).dot(&axis(knee));
        let parallel = |body: &&usize| {
            let both = [**body, knee].map(|body| model.bodies[body].dof);
            both == [DofKind::Revolute; 2] && along(**body).abs() > PARALLEL
        };
        let before = *limb.bodies[..place].iter().rev().find(parallel)?;
        let behind = limb.bodies[place + 1..].iter().find(parallel);
        let turned = [(before, -1.0), (knee, 2.0)].into_iter().chain(behind.map(|body| (*body, -1.0)));
        let turns = turned.map(|(body, share)| (body - 1, share * along(body).signum())).collect();
        Some(Self { axis: axis(knee), turns })
    }
}
