//! Small characters with closed-form motion, and random trees.

#![allow(dead_code)] // each test file uses its own part of this

use std::fmt::Write;
use std::sync::Arc;

use gaitwright_physics::character::{self, Options, Source};
use gaitwright_physics::model::{Base, Model};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

pub fn urdf(text: &str, fixed_base: bool) -> Arc<Model> {
    let reading = character::read(text.as_bytes(), Source::Urdf, Options::default())
        .unwrap_or_else(|error| panic!("{error}"));
    Arc::new(Model::new(Arc::new(reading.character), Base::fixed_if(fixed_base)))
}

fn inertia([x, y, z]: [f64; 3]) -> String {
    format!(r#"<inertia ixx="{x:?}" ixy="0" ixz="0" iyy="{y:?}" iyz="0" izz="{z:?}"/>"#)
}

/// A cube of 2 kg with edges of 0.2 m.
pub fn cube() -> Arc<Model> {
    let inertia = inertia([2.0 * 0.04 / 6.0; 3]);
    urdf(
        &format!(
            r#"<robot name="cube"><link name="cube"><inertial><mass value="2"/>{inertia}</inertial>
            <collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link></robot>"#
        ),
        false,
    )
}

/// A solid ball of 1 kg and 0.1 m.
pub fn ball() -> Arc<Model> {
    let inertia = inertia([0.4 * 0.01; 3]);
    urdf(
        &format!(
            r#"<robot name="ball"><link name="ball"><inertial><mass value="1"/>{inertia}</inertial>
            <collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>"#
        ),
        false,
    )
}

/// An asymmetric body without shapes, its centre of mass away from its origin.
pub fn brick(principal: [f64; 3], center: [f64; 3]) -> Arc<Model> {
    let inertia = inertia(principal);
    let [x, y, z] = center;
    urdf(
        &format!(
            r#"<robot name="brick"><link name="brick"><inertial><origin xyz="{x:?} {y:?} {z:?}"/>
            <mass value="1.5"/>{inertia}</inertial></link></robot>"#
        ),
        false,
    )
}

/// A link of a planar chain: hinged about −y at its origin, hanging along −z at angle 0.
#[derive(Debug, Clone, Copy)]
pub struct Bar {
    /// kg.
    pub mass: f64,
    /// From the hinge to the centre of mass, m.
    pub center: f64,
    /// From the hinge to the next one, m.
    pub length: f64,
    /// About the centre of mass, kg m².
    pub inertia: f64,
}

/// What a chain of bars hangs from.
#[derive(Debug, Clone, Copy)]
pub enum Hanging {
    /// The world.
    Bolted,
    /// The first bar itself is the root and flies.
    Free,
    /// A box of the given mass (kg) and half of its edges' length (m) on the ground, its centre being the hinge.
    Cart(f64, [f64; 3]),
}

/// A planar chain of `bars`, with `joint` inside every joint element (limits, dynamics).
pub fn chain(hanging: Hanging, bars: &[Bar], joint: &str) -> Arc<Model> {
    let mut text = String::from(r#"<robot name="chain">"#);
    let (mut parent, mut hinge) = ("base".to_owned(), 0.0);
    match hanging {
        Hanging::Bolted => text.push_str(r#"<link name="base"/>"#),
        Hanging::Free => {}
        Hanging::Cart(mass, [x, y, z]) => {
            let third = mass / 3.0;
            let inertia =
                inertia([third * (y * y + z * z), third * (x * x + z * z), third * (x * x + y * y)]);
            let size = format!("{:?} {:?} {:?}", 2.0 * x, 2.0 * y, 2.0 * z);
            let _ = write!(
                text,
                r#"<link name="base"><inertial><mass value="{mass:?}"/>{inertia}</inertial>
                <collision><geometry><box size="{size}"/></geometry></collision></link>"#
            );
        }
    }
    for (index, bar) in bars.iter().enumerate() {
        let Bar { mass, center, length, inertia: i } = *bar;
        let _ = write!(
            text,
            r#"<link name="bar{index}"><inertial><origin xyz="0 0 {:?}"/><mass value="{mass:?}"/>{}</inertial></link>"#,
            -center,
            inertia([i, i, 0.2 * i]),
        );
        if index > 0 || !matches!(hanging, Hanging::Free) {
            let kind = if joint.contains("limit") { "revolute" } else { "continuous" };
            let _ = write!(
                text,
                r#"<joint name="hinge{index}" type="{kind}"><parent link="{parent}"/><child link="bar{index}"/>
                <origin xyz="0 0 {hinge:?}"/><axis xyz="0 -1 0"/>{joint}</joint>"#
            );
        }
        (parent, hinge) = (format!("bar{index}"), -length);
    }
    text.push_str("</robot>");
    urdf(&text, matches!(hanging, Hanging::Bolted))
}

fn triple(rng: &mut ChaCha8Rng, size: f64) -> String {
    let [x, y, z] = [0; 3].map(|_| rng.random_range(-size..size));
    format!("{x:?} {y:?} {z:?}")
}

/// A random tree of `links` links: boxes of random size, mass and place, joined by hinges and slides.
pub fn tree(rng: &mut ChaCha8Rng, links: usize, fixed_base: bool) -> Arc<Model> {
    let mut text = String::from(r#"<robot name="tree">"#);
    for link in 0..links {
        let mass = 10f64.powf(rng.random_range(-0.5..0.5));
        let [x, y, z] = [0; 3].map(|_| rng.random_range(0.05..0.3));
        let twelfth = mass / 12.0;
        let inertia =
            inertia([twelfth * (y * y + z * z), twelfth * (x * x + z * z), twelfth * (x * x + y * y)]);
        let (at, turned) = (triple(rng, 0.1), triple(rng, 3.0));
        let _ = write!(
            text,
            r#"<link name="l{link}"><inertial><origin xyz="{at}" rpy="{turned}"/><mass value="{mass:?}"/>{inertia}</inertial></link>"#
        );
        if link > 0 {
            let parent = rng.random_range(0..link);
            let kind = if rng.random_range(0..4) == 0 { "prismatic" } else { "continuous" };
            let limit = if kind == "prismatic" {
                r#"<limit lower="-1000" upper="1000" effort="100" velocity="100"/>"#
            } else {
                ""
            };
            let (at, turned, axis) = (triple(rng, 0.3), triple(rng, 3.0), triple(rng, 1.0));
            let _ = write!(
                text,
                r#"<joint name="j{link}" type="{kind}"><parent link="l{parent}"/><child link="l{link}"/>
                <origin xyz="{at}" rpy="{turned}"/><axis xyz="{axis}"/>{limit}</joint>"#
            );
        }
    }
    text.push_str("</robot>");
    urdf(&text, fixed_base)
}
