//! Scratch memory of a step in maximal coordinates.

use super::forecast::Forecast;
use super::response::BodyFactor;
use crate::model::Model;
use crate::scene::StepPlan;
use crate::sim::spatial::SpatialMotion;

/// What a step in maximal coordinates needs beside what every step needs.
#[derive(Debug, Clone)]
pub struct MaximalWorkspace {
    /// Factors of the bodies' inertias.
    pub factors: Vec<BodyFactor>,
    /// C of every body. (turning)
    pub row_correction: Vec<SpatialMotion>,
    /// The step in joint coordinates.
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
