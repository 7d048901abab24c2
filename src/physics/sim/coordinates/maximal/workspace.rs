//! Scratch memory of a step in maximal coordinates.

use super::forecast::Forecast;
use super::response::BodyFactor;
use crate::model::Model;
use crate::scene::StepPlan;
use crate::sim::spatial::SpatialMotion;

/// Scratch memory that only maximal coordinates need, one entry a body.
#[derive(Debug, Clone)]
pub struct MaximalWorkspace {
    /// Factors of the bodies' inertias. (new)
    pub factors: Vec<BodyFactor>,
    /// C of every body, the velocity that the rows read in addition to the body's own. (row_correction)
    pub row_correction: Vec<SpatialMotion>,
    /// The step in joint coordinates. (Forecast::run)
    pub forecast: Forecast,
}

impl MaximalWorkspace {
    /// For `model` as `plan` steps it.
    pub fn new(model: &Model, plan: &StepPlan) -> Self {
        let factor = |(index, body)| {
            if index == 0 && model.fixed_base { BodyFactor::FIXED } else { BodyFactor::new(body) }
        };
        Self {
            factors: model.bodies.iter().enumerate().map(factor).collect(),
            row_correction: vec![SpatialMotion::ZERO; model.bodies.len()],
            forecast: Forecast::new(model, plan),
        }
    }
}
