//! Friction and restitution of every pair of surfaces.
//!
//! Whatever states no coefficient of its own has the scene's. In a contact the smaller of both coefficients of friction holds,
//! as in Gazebo, from whose elements a URDF's coefficients come (ODE and its users do the same), and the greater of both of
//! restitution, as in Box2D, so that a ball that bounces does so on any ground.

use nalgebra::Vector3;

use super::Scene;
use crate::character::{Friction, SurfaceMaterial};
use crate::model::Model;

/// Coefficients of friction and restitution of a pair of surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairMaterial {
    /// Of Coulomb friction; the greatest where it depends on the direction of sliding.
    pub friction: f64,
    /// Of restitution, 0 to 1.
    pub restitution: f64,
}

impl PairMaterial {
    /// Of this surface in a scene whose own coefficients are `usual`.
    fn of(surface: SurfaceMaterial, usual: Self) -> Self {
        Self {
            friction: surface.friction.map_or(usual.friction, Friction::greatest),
            restitution: surface.restitution.unwrap_or(usual.restitution),
        }
    }

    /// In a contact of both.
    pub fn with(self, other: Self) -> Self {
        Self {
            friction: self.friction.min(other.friction),
            restitution: self.restitution.max(other.restitution),
        }
    }

    /// The greater of both in either.
    fn greatest(self, other: Self) -> Self {
        Self { friction: self.friction.max(other.friction), ..self.with(other) }
    }
}

/// Friction of a link that depends on the direction in which it slides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grain {
    /// Coefficient along the axis.
    pub along: f64,
    /// Coefficient across it.
    pub across: f64,
    /// Unit vector in the frame of the link's body.
    pub axis: Vector3<f64>,
}

/// Coefficients of everything that can touch.
#[derive(Debug, Clone, PartialEq)]
pub struct Surfaces {
    /// Of the ground: the scene's.
    pub ground: PairMaterial,
    /// Of the character's links, in their order.
    pub links: Vec<PairMaterial>,
    /// Of the links whose friction depends on the direction, in the same order; empty where there is none.
    grains: Vec<Option<Grain>>,
    /// Of the scene's obstacles, in their order.
    pub obstacles: Vec<PairMaterial>,
}

impl Surfaces {
    /// Of the character of `model` in `scene`.
    pub fn new(scene: &Scene, model: &Model) -> Self {
        let ground = PairMaterial { friction: scene.friction, restitution: scene.restitution };
        let links = &model.character.links;
        let mut grains: Vec<Option<Grain>> = links
            .iter()
            .zip(&model.links)
            .map(|(link, place)| match link.surface.friction? {
                Friction::Directional { along, across, axis } if along != across => {
                    Some(Grain { along, across, axis: place.pose.rotation * axis.into_inner() })
                }
                _ => None,
            })
            .collect();
        if grains.iter().all(Option::is_none) {
            grains.clear();
        }
        Self {
            ground,
            links: links.iter().map(|link| PairMaterial::of(link.surface, ground)).collect(),
            grains,
            obstacles: scene.obstacles.iter().map(|it| PairMaterial::of(it.surface(), ground)).collect(),
        }
    }

    /// The friction of link `link`, if it depends on the direction.
    pub fn grain(&self, link: usize) -> Option<&Grain> {
        self.grains.get(link)?.as_ref()
    }

    /// Whether the friction of a link depends on the direction.
    pub fn has_grains(&self) -> bool {
        !self.grains.is_empty()
    }

    /// The greatest coefficient of friction and of restitution that a link, the ground or an obstacle has.
    pub fn greatest(&self) -> PairMaterial {
        self.links.iter().chain(&self.obstacles).copied().fold(self.ground, PairMaterial::greatest)
    }
}
