//! Characters that nobody would draw: random trees of up to 60 links whose masses span six decades.

use serde_json::{Value, json};

use super::case::Case;
use super::quantity::Quantity;
use super::sketch::{air, body, character, limits, moving, scenario, turning, with};
use gaitwright_physics::scene::{Effect, Scene, Switch};

/// Number of links of each random character.
const LINKS: [usize; 8] = [1, 2, 3, 5, 8, 15, 30, 60];

/// The cases of random characters.
pub fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (seed, links) in LINKS.into_iter().enumerate() {
        let tree = Tree::random(seed as u64 + 1, links);
        let document = character("random", &tree.links, &tree.joints);
        let speeds = || tree.speeds.iter().map(|(name, speed)| (name.as_str(), 0.0, *speed));
        // Links placed at random overlap.
        let apart = || [(Effect::SelfCollision, Switch::Off)].into();
        let mut free = scenario(document.clone(), Scene { gravity: [0.0; 3], effects: apart(), ..air() });
        free.start.root = Some(turning([0.0; 3], [0.5, -1.0, 2.0]));
        free.start.joints = moving(speeds());
        cases.push(
            Case::new(
                format!("random-{links}-free"),
                format!("a random character of {links} links, moving freely"),
                free,
            )
            .at_most(0.05, Quantity::EnergyGainShare)
            .at_most(1e-2, Quantity::LimitOvershoot),
        );
        let mut falling = scenario(document, Scene { effects: apart(), ..Scene::default() });
        falling.start.joints = moving(speeds());
        cases.push(
            Case::new(
                format!("random-{links}-on-ground"),
                format!("a random character of {links} links collapses on the ground"),
                falling,
            )
            .at_most(0.05, Quantity::EnergyGainShare)
            .at_most(1e-2, Quantity::LimitOvershoot)
            // A step may deepen a contact by 1.5e-3 of the character's size, some 0.2 mm. At mass ratios of a million to one several steps in sequence do so
            // before it is corrected.
            .at_most(4e-3, Quantity::Penetration),
        );
    }
    cases
}

/// Links and joints of a random character, and the speeds at which its joints start.
struct Tree {
    links: Vec<Value>,
    joints: Vec<Value>,
    speeds: Vec<(String, f64)>,
}

impl Tree {
    fn random(seed: u64, count: usize) -> Self {
        let mut dice = Dice(seed);
        let mut tree = Self { links: Vec::new(), joints: Vec::new(), speeds: Vec::new() };
        for index in 0..count {
            let size = 0.03 + 0.1 * dice.share();
            let mass = 10.0_f64.powf(dice.between(-3.0, 3.0));
            let moments = [0, 1, 2].map(|_| mass * size * size * dice.between(0.3, 0.5));
            let center = [0, 1, 2].map(|_| size * dice.between(-0.3, 0.3));
            let shape = match dice.below(3) {
                0 => json!({ "kind": "sphere", "radius": size }),
                1 => json!({ "kind": "box", "size": [size, 1.5 * size, 2.0 * size] }),
                _ => json!({ "kind": "capsule", "radius": 0.5 * size, "length": size }),
            };
            let link = format!("link_{index}");
            tree.links.push(with(body(&link, mass, center, moments), &json!({ "shapes": [shape] })));
            if index == 0 {
                continue;
            }
            let name = format!("joint_{index}");
            let slides = dice.below(5) == 0;
            let position = [0, 1, 2].map(|_| dice.between(-0.3, 0.3));
            let turn = [0, 1, 2].map(|_| dice.between(-3.0, 3.0));
            let axis = [dice.between(-1.0, 1.0), dice.between(-1.0, 1.0), 1.0];
            let joint = json!({
                "name": name, "parent": format!("link_{}", dice.below(index)), "child": link,
                "kind": if slides { "prismatic" } else { "continuous" },
"origin": { "position": position, "rpy": turn }, "axis": axis});
            let reach = if slides { 0.1 } else { dice.between(0.1, 2.0) };
            let limited = slides || dice.below(2) == 0;
            let kind = json!({ "kind": if slides { "prismatic" } else { "revolute" } });
            tree.joints.push(if limited { with(joint, &with(limits(-reach, reach), &kind)) } else { joint });
            tree.speeds.push((name, dice.between(-2.0, 2.0)));
        }
        tree
    }
}

/// Pseudo-random numbers, the same on every machine (Steele, Lea & Flood 2014, SplitMix64).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ (bits >> 31)
    }

    /// Uniform, from 0 up to 1.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    fn below(&mut self, count: usize) -> usize {
        (self.share() * count as f64) as usize
    }
}
