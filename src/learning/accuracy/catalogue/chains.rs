//! Chains: masses that differ a millionfold, a hundred links, links without mass, poses in which axes line up.

use serde_json::{Value, json};

use super::case::Case;
use super::quantity::Quantity;
use super::sketch::{
    GRAVITY, air, block, body, character, fixed_base, hinge, limits, moving, rod, scenario, second_order,
    space, turning, with,
};
use crate::scenario::{CharacterSource, Scenario};
use gaitwright_physics::scene::Scene;

/// Share of the energy that can be released which a simulation may gain by its numerical errors.
const GAIN: f64 = 0.05;

const Y: [f64; 3] = [0.0, 1.0, 0.0];
const X: [f64; 3] = [1.0, 0.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// The cases of chains.
pub fn cases() -> Vec<Case> {
    let mut cases = mass_ratios();
    cases.extend(long_chains());
    cases.extend(odd_links());
    cases
}

/// Rods of these masses (kg), each `length` m long, one below the other; joint i has axis i of `axes`, which repeat.
struct Chain<'a> {
    masses: &'a [f64],
    length: f64,
    axes: &'a [[f64; 3]],
}

impl Chain<'_> {
    fn character(&self, name: &str) -> CharacterSource {
        let mut links = vec![body("base", 1.0, [0.0; 3], [0.1; 3])];
        let mut joints = Vec::new();
        for (index, mass) in self.masses.iter().enumerate() {
            let (parent, at) = if index == 0 {
                ("base".to_owned(), [0.0; 3])
            } else {
                (format!("link_{}", index - 1), [0.0, 0.0, -self.length])
            };
            let axis = self.axes[index % self.axes.len()];
            joints.push(hinge(&format!("joint_{index}"), &parent, &format!("link_{index}"), at, axis));
            links.push(rod(&format!("link_{index}"), *mass, self.length));
        }
        character(name, &links, &joints)
    }

    /// Weight of the chain times the distance of its centre of mass from the first joint when it hangs
    /// straight, J: the energy that a chain that starts level can release.
    fn weight_moment(&self) -> f64 {
        let centers = self.masses.iter().enumerate();
        let moment: f64 = centers.map(|(index, mass)| mass * self.length * (index as f64 + 0.5)).sum();
        GRAVITY * moment
    }

    /// Moment of inertia about the first joint when it is straight, kg m².
    fn inertia(&self) -> f64 {
        let links = self.masses.iter().enumerate();
        let of_link = |(index, mass): (usize, &f64)| {
            mass * self.length * self.length * ((index as f64 + 0.5).powi(2) + 1.0 / 12.0)
        };
        links.map(of_link).sum()
    }
}

/// The chain swinging from a first joint at `angle` rad.
fn swinging(chain: &Chain<'_>, name: &str, angle: f64) -> Scenario {
    let mut scenario = fixed_base(chain.character(name), air());
    scenario.start.joints = moving([("joint_0", angle, 0.0)]);
    scenario
}

fn mass_ratios() -> Vec<Case> {
    let up = [1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3];
    let down = [1e3, 1e2, 1e1, 1.0, 1e-1, 1e-2, 1e-3];
    let swing = |name: &str, about: &str, masses: &[f64]| {
        let chain = Chain { masses, length: 0.3, axes: &[Y, X] };
        let available = chain.weight_moment() * (1.0 - 1.0_f64.cos());
        Case::new(name, about, second_order(swinging(&chain, "chain", 1.0)))
            .at_most(GAIN * available, Quantity::EnergyGain)
    };
    let (grams, tonnes) = (1e-3, 1e3);
    vec![
        swing(
            "ratio-light-to-heavy",
            "a swinging chain whose links weigh 1 g to 1 t from top to bottom",
            &up,
        ),
        swing(
            "ratio-heavy-to-light",
            "a swinging chain whose links weigh 1 t to 1 g from top to bottom",
            &down,
        ),
        swing("ratio-1e-6", "a pendulum of 1 t on a rod of 1 g", &[grams, tonnes]),
        swing("ratio-1e6", "a rod of 1 g at the end of a pendulum of 1 t", &[tonnes, grams]),
        press("heavy-on-light", "1 t pressed on a plate of 1 g through the end of a slide", grams, tonnes),
        press("light-on-heavy", "1 g pressed on a plate of 1 t through the end of a slide", tonnes, grams),
    ]
}

/// A plate on the ground and a block that slides down on it to the end of its slide, at rest. Nothing may
/// move.
fn press(name: &str, about: &str, plate: f64, weight: f64) -> Case {
    let slide = with(
        hinge("slide", "plate", "weight", [0.0, 0.0, 0.2], Z),
        &with(limits(0.0, 0.1), &json!({ "kind": "prismatic" })),
    );
    let links = [block("plate", plate, [0.4, 0.4, 0.1]), block("weight", weight, [0.2; 3])];
    let mut scenario = scenario(character("press", &links, &[slide]), Scene::default());
    scenario.start.root = Some(super::sketch::resting([0.0, 0.0, 0.05]));
    Case::new(name, about, scenario)
        .at_most(1e-4, Quantity::Penetration)
        .at_most(1e-4, Quantity::LimitOvershoot)
        .at_most(1e-4, Quantity::Creep { after: 0.0 })
        .at_most(1e-3, Quantity::RootSpeed { after: 0.0 })
        .at_most(
            0.01 * GRAVITY * (plate + weight),
            Quantity::FinalWeight { wanted: GRAVITY * (plate + weight) },
        )
}

/// Share of its energy that a long chain may gain at four times the default step. In whip-like motion its last link
/// reaches about 1000 rad/s for a few milliseconds.
const WHIP_GAIN: f64 = 0.05;

fn long_chains() -> Vec<Case> {
    let masses = [0.05; 100];
    let flat = Chain { masses: &masses, length: 0.05, axes: &[Y] };
    let spatial = Chain { masses: &masses, length: 0.05, axes: &[Y, X] };
    let drop = flat.weight_moment();
    let level = std::f64::consts::FRAC_PI_2;

    let mut hanging = fixed_base(flat.character("chain"), air());
    let names: Vec<String> = (0..masses.len()).map(|index| format!("joint_{index}")).collect();
    let lean = 1e-3;
    hanging.start.joints = moving(names.iter().map(|name| (name.as_str(), lean, 0.0)));
    // Link i is inclined by (i + 1) milliradians; the height of its centre follows from the links above it.
    let lift: f64 = (0..masses.len())
        .map(|index| {
            let risen = |link: usize| 1.0 - (lean * (link as f64 + 1.0)).cos();
            let above: f64 = (0..index).map(risen).sum();
            GRAVITY * masses[index] * 0.05 * (above + 0.5 * risen(index))
        })
        .sum();

    let whirl = 10.0;
    let tilt: f64 = 0.8;
    let mut whirling = fixed_base(Chain { axes: &[Z, Y, X], ..spatial }.character("chain"), air());
    whirling.start.joints = moving([("joint_0", 0.0, whirl), ("joint_1", tilt, 0.0)]);
    // From the second link on the chain is off the axis.
    let off_axis = Chain { masses: &masses[1..], ..spatial }.inertia() * tilt.sin().powi(2);
    let whirling_energy = 0.5 * off_axis * whirl * whirl + drop * (1.0 - tilt.cos());

    let spin = 20.0;
    let mut thrown = scenario(flat.character("chain"), space());
    thrown.start.root = Some(turning([0.0; 3], [0.0, spin, 0.0]));
    // About the centre of mass of the chain and of the base of 1 kg at its end.
    let (mass, center): (f64, f64) = (5.0, 2.5);
    let inertia = flat.inertia() + 0.1 - (mass * center).powi(2) / (mass + 1.0);
    let thrown_energy = 0.5 * inertia * spin * spin;
    // Momentum is kept to rounding in flight, whatever the method and however it bends the chain: ten seconds are 5000 steps,
    // each with the rounding of 100 bodies, 1e-13 of what there is.
    let bounded = |case: Case| {
        case.at_most(GAIN * thrown_energy, Quantity::EnergyGain)
            .at_most(1e-8 * inertia * spin, Quantity::AngularMomentumChange)
            .at_most(1e-8 * mass * center * spin, Quantity::MomentumChange)
            // Its shortest transverse waves have 2000 rad/s. At four times the step they are not resolved, and the chain does
            // not stay straight.
            .at_its_own_step()
    };

    vec![
        Case::new("chain-hanging", "100 links hang, a milliradian off each", hanging)
            .at_most(GAIN * lift, Quantity::EnergyGain),
        Case::new(
            "chain-released",
            "100 links released from horizontal, all in one plane",
            second_order(swinging(&flat, "chain", level)),
        )
        .at_most(WHIP_GAIN * drop, Quantity::EnergyGain),
        Case::new(
            "chain-released-in-space",
            "100 links released from horizontal, axes crossed",
            second_order(swinging(&spatial, "chain", level)),
        )
        .at_most(WHIP_GAIN * drop, Quantity::EnergyGain),
        Case::new("chain-whirling", "100 links whirl about the vertical at 10 rad/s", second_order(whirling))
            .at_most(GAIN * whirling_energy, Quantity::EnergyGain),
        bounded(Case::new(
            "chain-thrown",
            "100 links and a weight spin freely at 20 rad/s without gravity",
            second_order(thrown.clone()),
        )),
        bounded(Case::new("chain-thrown-by-default", "the same with the default settings", thrown)),
    ]
}

fn odd_links() -> Vec<Case> {
    let bone = |name: &str| rod(name, 1.0, 0.3);
    let frame = |name: &str| json!({ "name": name });
    let grain = |name: &str| body(name, 1e-5, [0.0; 3], [1e-9; 3]);
    let base = || body("base", 1.0, [0.0; 3], [0.1; 3]);
    let shoulder = |middle: &dyn Fn(&str) -> Value| {
        // Three crossed hinges through two small links, which is how URDFs model a ball joint, and a bone between.
        let links = [base(), bone("upper"), middle("yaw"), middle("pitch"), bone("lower")];
        let joints = [
            hinge("shoulder", "base", "upper", [0.0; 3], Y),
            hinge("elbow_yaw", "upper", "yaw", [0.0, 0.0, -0.3], Z),
            hinge("elbow_pitch", "yaw", "pitch", [0.0; 3], Y),
            hinge("elbow_roll", "pitch", "lower", [0.0; 3], X),
        ];
        let mut scenario = fixed_base(character("arm", &links, &joints), air());
        scenario.start.joints =
            moving([("shoulder", 1.0, 0.0), ("elbow_roll", 0.5, 0.0), ("elbow_yaw", 0.0, 1.0)]);
        scenario
    };
    // The lower bone by itself and both from the shoulder, both at least at 1 rad.
    let available = GRAVITY * (0.15 + 0.45) * 2.0;
    let stiff = body("weight", 1.0, [0.0; 3], [1.0; 3]);
    let small = [base(), grain("grain"), stiff];
    let joints =
        [hinge("near", "base", "grain", [0.0; 3], X), hinge("far", "grain", "weight", [0.0, 0.1, 0.0], Y)];
    let mut beside = scenario(character("grain", &small, &joints), space());
    beside.start.root = Some(turning([0.0; 3], [0.5, 1.0, 0.2]));
    beside.start.joints = moving([("near", 0.3, 2.0), ("far", 0.0, -1.0)]);
    // Two bodies of about 1 kg m² at about 2 rad/s.
    let beside_energy = 4.0;
    let mut locked = shoulder(&|name| body(name, 0.1, [0.0; 3], [1e-4; 3]));
    let level = std::f64::consts::FRAC_PI_2;
    locked.start.joints =
        moving([("elbow_pitch", level, 0.0), ("elbow_yaw", 0.3, 1.0), ("shoulder", 0.5, 0.0)]);
    vec![
        Case::new(
            "links-without-mass",
            "an elbow of three hinges through two links without mass",
            shoulder(&frame),
        )
        .at_most(GAIN * available, Quantity::EnergyGain),
        Case::new(
            "links-of-a-grain",
            "an elbow of three hinges through two links of 10 mg",
            shoulder(&grain),
        )
        .at_most(GAIN * available, Quantity::EnergyGain),
        Case::new("inertia-1e-9", "a link of 1e-9 kg m² between bodies of 1 kg m²", beside)
            .at_most(GAIN * beside_energy, Quantity::EnergyGain)
            .at_most(GAIN * 4.0, Quantity::AngularMomentumChange),
        Case::new("gimbal-lock", "an elbow of three hinges whose first and last axes line up", locked)
            .at_most(GAIN * available, Quantity::EnergyGain),
    ]
}
