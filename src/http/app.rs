//! What the handlers share.

use std::sync::Arc;

use super::caller::Caller;
use super::figures::ProcessFigures;
use super::limits::{NoPlace, Place, Places};
use super::problem::ProblemDetails;
use crate::jobs::Jobs;

/// The state of the router.
#[derive(Clone)]
pub(super) struct App {
    pub(super) jobs: Jobs,
    /// Places of simulations.
    pub(super) simulations: Arc<Places>,
    /// Places of those who follow events and growing recordings.
    pub(super) streams: Arc<Places>,
    /// Places of large bodies of requests.
    pub(super) bodies: Arc<Places>,
    pub(super) figures: ProcessFigures,
    /// The description of the interface.
    pub(super) openapi: Arc<serde_json::Value>,
}

impl App {
    /// A place for `caller` among those who follow something, for as long as it is kept.
    pub(super) fn stream(&self, caller: Caller) -> Result<Place, ProblemDetails> {
        self.streams.take(caller).map_err(|why| match why {
            NoPlace::ForCaller => {
                ProblemDetails::busy("this caller follows as many streams as one may at once")
            }
            NoPlace::ForAnyone => ProblemDetails::crowded("as many streams are followed as may be at once"),
        })
    }

    /// A place for a simulation of `caller`, for as long as it is kept.
    pub(super) fn simulation(&self, caller: Caller) -> Result<Place, ProblemDetails> {
        self.simulations.take(caller).map_err(|why| match why {
            NoPlace::ForCaller => {
                ProblemDetails::busy("this caller runs as many simulations as one may at once")
            }
            NoPlace::ForAnyone => ProblemDetails::busy("as many simulations run as may run at once"),
        })
    }
}
