//! Static shapes in a scene.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::character::{self, Friction, Placed, ShapeDocument, SurfaceMaterial};
use crate::fault::Fault;

/// Greatest number of obstacles of a scene.
const OBSTACLES: usize = 1000;

/// A solid that stands still in the world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// How results name it; `obstacle 3` for the fourth of the list when left out.
    #[serde(default)]
    pub name: Option<String>,
    /// Its shape, in the words of character documents; its pose is that in the world.
    pub shape: ShapeDocument,
    /// Its friction coefficient; the scene's when left out. In a contact the smaller of both sides holds.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub friction: Option<f64>,
    /// Its coefficient of restitution; the scene's when left out. In a contact the greater of both sides holds.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1))]
    pub restitution: Option<f64>,
}

impl Obstacle {
    /// The shape in the world.
    ///
    /// # Errors
    /// Every fault of the shape, with JSON pointers into the obstacle.
    pub fn placed(&self) -> Result<Placed, Vec<Fault>> {
        character::read_shape(&self.shape)
            .map_err(|faults| faults.into_iter().map(|fault| fault.under("/shape")).collect())
    }

    /// What it is like to touch.
    pub fn surface(&self) -> SurfaceMaterial {
        SurfaceMaterial { friction: self.friction.map(Friction::Uniform), restitution: self.restitution }
    }

    /// The name by which results call the obstacle at `index` of its list.
    pub fn name(&self, index: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("obstacle {index}"))
    }
}

/// Everything impossible in a list of obstacles.
pub fn obstacle_faults(obstacles: &[Obstacle]) -> Vec<Fault> {
    if obstacles.len() > OBSTACLES {
        let reason =
            format!("the scene has {} obstacles; at most {OBSTACLES} are simulated", obstacles.len());
        return vec![Fault::new("", reason)];
    }
    let mut faults = Vec::new();
    let mut names = BTreeSet::new();
    for (index, obstacle) in obstacles.iter().enumerate() {
        let name = obstacle.name(index);
        if name.trim().is_empty() {
            faults.push(Fault::new(format!("/{index}/name"), "the name is empty"));
        } else if !names.insert(name.clone()) {
            faults.push(Fault::new(format!("/{index}/name"), format!("there is another obstacle {name:?}")));
        }
        let shape = obstacle.placed().err().unwrap_or_default();
        let surface = obstacle.surface().faults();
        faults.extend(shape.into_iter().chain(surface).map(|fault| fault.under(&format!("/{index}"))));
    }
    faults
}
