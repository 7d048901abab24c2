//! Friction and restitution of every pair of surfaces.
//!
//! Whatever states no coefficient of its own has the scene's. In a contact the smaller of both coefficients of friction holds,
//! as in Gazebo, from whose elements a URDF's coefficients come (ODE and its users do the same), and the greater of both of
//! restitution, as in Box2D, so that a ball that bounces does so on any ground.

use super::Scene;
use crate::character::{Character, SurfaceMaterial};

/// Coefficients of friction and restitution of a pair of surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairMaterial {
    /// Of Coulomb friction.
    pub friction: f64,
    /// Of restitution, 0 to 1.
    pub restitution: f64,
}

impl PairMaterial {
    /// Of this surface in a scene whose own coefficients are `usual`.
    fn of(surface: SurfaceMaterial, usual: Self) -> Self {
        Self {
            friction: surface.friction.unwrap_or(usual.friction),
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

/// Coefficients of everything that can touch.
#[derive(Debug, Clone, PartialEq)]
pub struct Surfaces {
    /// Of the ground: the scene's.
    pub ground: PairMaterial,
    /// Of the character's links, in their order.
    pub links: Vec<PairMaterial>,
    /// Of the scene's obstacles, in their order.
    pub obstacles: Vec<PairMaterial>,
}

impl Surfaces {
    /// Of `character` in `scene`.
    pub fn new(scene: &Scene, character: &Character) -> Self {
        let ground = PairMaterial { friction: scene.friction, restitution: scene.restitution };
        Self {
            ground,
            links: character.links.iter().map(|link| PairMaterial::of(link.surface, ground)).collect(),
            obstacles: scene.obstacles.iter().map(|it| PairMaterial::of(it.surface(), ground)).collect(),
        }
    }

    /// The greatest coefficient of friction and of restitution that a link, the ground or an obstacle has.
    pub fn greatest(&self) -> PairMaterial {
        self.links.iter().chain(&self.obstacles).copied().fold(self.ground, PairMaterial::greatest)
    }
}
