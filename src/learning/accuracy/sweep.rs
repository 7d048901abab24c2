//! The settings that are tried.
//!
//! Every combination of all settings would be unreadable. One setting is the base, and every other method changes one
//! thing about it. Each method is tried at every step of the sweep. A method under error control gets a tolerance
//! with each step: within a step targets move linearly, so the step's length matters whatever the tolerance.

use super::engine::Engine;
use super::fault::LeftOutReason;
use super::problem::AccuracyProblem;
use super::settings::TrialSettings;
use gaitwright_physics::scene::{
    Accuracy, Coordinates, Feedforward, FrictionCone, Integrator, JointBias, SolverChoice, SolverKind,
    StepPlan,
};

/// How finely the methods are tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Steps, s, the longest first.
    pub steps: Vec<f64>,
    /// Tolerances of a step for the methods under error control, rad or m, one for each of `steps`.
    pub step_tolerances: Vec<f64>,
    /// How many times each piece is timed; the shortest time counts.
    pub repeats: u32,
}

impl Default for Sweep {
    /// Steps from 32 ms to 1/8 ms by halves.
    fn default() -> Self {
        Self {
            steps: (0..9).map(|halvings| 0.032 / f64::from(1 << halvings)).collect(),
            step_tolerances: vec![1e-1, 3e-2, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8],
            repeats: 5,
        }
    }
}

/// A way to simulate, without the length of the step.
#[derive(Debug, Clone, PartialEq)]
pub struct Method {
    /// Its name: what differs from the base.
    pub name: String,
    /// The simulator that computes the steps.
    pub engine: Engine,
    /// The feedforward, where it is another than the scenario asks for.
    pub feedforward: Option<Feedforward>,
    /// Its settings; the step is replaced by those of the sweep.
    accuracy: Accuracy,
    /// Whether it divides its steps to keep a tolerance of the sweep.
    controlled: bool,
}

/// A method and its settings that are tried, or why it is left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// The method.
    pub method: Method,
    /// Its settings, the longest step first.
    pub settings: Result<Vec<TrialSettings>, LeftOutReason>,
}

impl Sweep {
    /// The finest step, s; that of the default settings where there is none.
    pub fn finest(&self) -> f64 {
        self.steps.iter().copied().min_by(f64::total_cmp).unwrap_or(Accuracy::default().step)
    }

    /// The settings for `problem`.
    pub fn series(&self, problem: &AccuracyProblem) -> Vec<Series> {
        let plan = problem.setup.plan(&Accuracy::default());
        let reason = |method: &Method| match &plan {
            Ok(plan) => method.reason_against(problem, plan),
            Err(error) => Some(LeftOutReason::Plan(error.clone())),
        };
        let methods = methods(problem).into_iter();
        methods
            .map(|method| match reason(&method) {
                Some(reason) => Series { settings: Err(reason), method },
                None => Series { settings: Ok(self.settings(&method)), method },
            })
            .collect()
    }

    /// The settings of `method`.
    fn settings(&self, method: &Method) -> Vec<TrialSettings> {
        let tried = |accuracy| TrialSettings { engine: method.engine, accuracy };
        if method.controlled {
            let pairs = self.steps.iter().zip(&self.step_tolerances);
            let controlled =
                |(&step, &tolerance)| Accuracy { step, step_tolerance: Some(tolerance), ..method.accuracy };
            pairs.map(controlled).map(tried).collect()
        } else {
            self.steps.iter().map(|&step| tried(Accuracy { step, ..method.accuracy })).collect()
        }
    }
}

/// The methods that are compared.
fn methods(problem: &AccuracyProblem) -> Vec<Method> {
    let base = Accuracy::default();
    let own = |name: &str, accuracy| Method {
        name: name.to_owned(),
        engine: Engine::Gaitwright,
        feedforward: None,
        accuracy,
        controlled: false,
    };
    let solver = |kind, iterations, tolerance| Accuracy {
        solver: SolverChoice { kind, iterations, tolerance },
        ..base
    };
    let second = Accuracy { integrator: Integrator::MoreauJean, ..base };
    let pyramid = Accuracy { friction_cone: FrictionCone::Pyramid, ..base };
    let maximal = Accuracy { coordinates: Coordinates::Maximal, ..base };
    let mut methods = vec![
        own("semi-implicit Euler", base),
        own("Moreau-Jean", second),
        Method { controlled: true, ..own("semi-implicit Euler, error control", base) },
        Method { controlled: true, ..own("Moreau-Jean, error control", second) },
        own("Gauss-Seidel, 5 sweeps", solver(SolverKind::Pgs, 5, 0.0)),
        own("Gauss-Seidel, 50 sweeps", solver(SolverKind::Pgs, 50, 0.0)),
        own("Gauss-Seidel to 1e-5", solver(SolverKind::Pgs, 2000, 1e-5)),
        own("Newton to 1e-5", solver(SolverKind::Newton, 50, 1e-5)),
        own("pyramid", pyramid),
        own(
            "pyramid, Lemke",
            Accuracy {
                solver: SolverChoice { kind: SolverKind::Lemke, iterations: 1000, ..base.solver },
                ..pyramid
            },
        ),
        own("maximal coordinates", maximal),
        own("maximal coordinates, paper's bias", Accuracy { joint_bias: JointBias::Paper, ..maximal }),
    ];
    let asked = problem.setup.gains.as_ref().map(|gains| gains.feedforward);
    for (feedforward, name) in [
        (Feedforward::None, "no feedforward"),
        (Feedforward::ContactFree, "contact-free feedforward"),
        (Feedforward::ContactAware, "contact-aware feedforward"),
    ] {
        if asked != Some(feedforward) {
            methods.push(Method { feedforward: Some(feedforward), ..own(name, base) });
        }
    }
    methods.push(Method { engine: Engine::Rapier, ..own("rapier", base) });
    methods
}

impl Method {
    /// Why this method cannot differ from the base, or cannot be used, on `problem` with the base's `plan`.
    fn reason_against(&self, problem: &AccuracyProblem, plan: &StepPlan) -> Option<LeftOutReason> {
        let base = Accuracy::default();
        let joints = problem.setup.model.joint_count();
        let rows = plan.ground.is_some() || plan.limits.is_some() || plan.dry_friction.is_some();
        let boxed = plan.drive.as_ref().is_some_and(|drive| drive.max_torque.is_some());
        let reason = if self.feedforward.is_some() && !problem.setup.script.has_targets() {
            LeftOutReason::NoTargets
        } else if self.accuracy.coordinates != base.coordinates && joints == 0 {
            LeftOutReason::NoJoints
        } else if self.accuracy.friction_cone != base.friction_cone && plan.friction.is_none() {
            LeftOutReason::NoFriction
        } else if self.accuracy.solver != base.solver && !(rows || boxed) {
            LeftOutReason::NothingToSolve
        } else {
            let faults = self.accuracy.faults();
            return (!faults.is_empty()).then_some(LeftOutReason::Settings(faults));
        };
        Some(reason)
    }
}
