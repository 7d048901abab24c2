//! What a recording is of, and what its views need to know of the character.

use nalgebra::{Isometry3, Vector3};

use gaitwright_learning::learn::reference_gravity;
use gaitwright_physics::character::Character;
use gaitwright_physics::scene::Scene;

/// Colour of the trunk, and of each limb in turn: a limb is what hangs on one joint of the root.
const TRUNK: [u8; 4] = [214, 219, 226, 255];
const LIMBS: [[u8; 4]; 8] = [
    [86, 180, 233, 255],
    [230, 159, 0, 255],
    [0, 190, 140, 255],
    [240, 120, 90, 255],
    [204, 121, 167, 255],
    [240, 228, 66, 255],
    [120, 150, 255, 255],
    [170, 200, 120, 255],
];

/// What a recording is of.
#[derive(Debug, Clone, Copy)]
pub struct RecordingSubject<'a> {
    /// Unique among recordings: a viewer merges files of the same id.
    pub id: &'a str,
    /// Name of the recording in a viewer.
    pub title: &'a str,
    /// The character; its links are those of every trace.
    pub character: &'a Character,
    /// Names of the joints in the order of every trace.
    pub joints: &'a [String],
    /// Where it is: ground and obstacles are shown.
    pub scene: &'a Scene,
}

/// What a recording needs to know of its character.
#[derive(Debug)]
pub(super) struct Appearance {
    pub(super) links: Vec<String>,
    pub(super) joints: Vec<String>,
    /// Colour of each link that has none of its own.
    pub(super) colors: Vec<[u8; 4]>,
    /// Weight under standard gravity, N.
    pub(super) weight: f64,
    /// Diagonal of the box around all link frames at zero angles, m; at least 10 cm.
    pub(super) size: f64,
    /// Height of that box, m.
    pub(super) height: f64,
}

impl Appearance {
    /// Of a recording's subject.
    pub(super) fn new(subject: &RecordingSubject<'_>) -> Self {
        let character = subject.character;
        let mass: f64 = character
            .links
            .iter()
            .filter_map(|link| link.inertial.as_ref())
            .map(|inertial| inertial.mass)
            .sum();
        let extent = extent(character);
        Self {
            links: character.links.iter().map(|link| link.name.clone()).collect(),
            joints: subject.joints.to_vec(),
            colors: limb_colors(character),
            weight: reference_gravity(subject.scene) * mass,
            size: extent.norm().max(0.1),
            height: extent.z,
        }
    }
}

/// Colour of each link by the limb it belongs to.
pub(in crate::export) fn limb_colors(character: &Character) -> Vec<[u8; 4]> {
    let mut limbs: Vec<Option<usize>> = Vec::with_capacity(character.links.len());
    let mut count = 0;
    for link in &character.links {
        let limb = match &link.joint {
            None => None,
            Some(joint) if joint.parent == 0 => {
                count += 1;
                Some(count - 1)
            }
            Some(joint) => limbs.get(joint.parent).copied().flatten(),
        };
        limbs.push(limb);
    }
    limbs.iter().map(|limb| limb.map_or(TRUNK, |limb| LIMBS[limb % LIMBS.len()])).collect()
}

/// Edges of the box around all link frames at zero angles, m.
fn extent(character: &Character) -> Vector3<f64> {
    let mut frames: Vec<Isometry3<f64>> = Vec::with_capacity(character.links.len());
    let (mut low, mut high) = (Vector3::zeros(), Vector3::zeros());
    for link in &character.links {
        let frame = match &link.joint {
            None => Isometry3::identity(),
            Some(joint) => frames.get(joint.parent).copied().unwrap_or_default() * joint.origin,
        };
        low = low.inf(&frame.translation.vector);
        high = high.sup(&frame.translation.vector);
        frames.push(frame);
    }
    high - low
}
