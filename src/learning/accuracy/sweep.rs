//! Which settings are tried.
//!
//! Not every combination of every knob, which nobody could read: one setting is the base, and every other method
//! changes one thing about it. Each is tried at every step of the sweep. A method under error control is given a
//! tolerance with each: within a step targets move evenly, so that its length matters whatever the tolerance.

use super::problem::Problem;
use super::table::Engine;
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
    /// How many times each piece is timed.
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

/// A way to simulate, whatever the step.
#[derive(Debug, Clone, PartialEq)]
pub struct Method {
    /// Its name: what differs from the base.
    pub name: String,
    /// Who computes.
    pub engine: Engine,
    /// The feedforward, where it is another than the scenario asks for.
    pub feedforward: Option<Feedforward>,
    /// Its settings but for the step.
    accuracy: Accuracy,
    /// Whether it chooses its steps itself.
    controlled: bool,
}

/// A single setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Who computes.
    pub engine: Engine,
    /// How.
    pub accuracy: Accuracy,
}

/// A method and the settings of it that are tried, or why there are none.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// The method.
    pub method: Method,
    /// Its settings, the cheapest first.
    pub points: Result<Vec<Point>, String>,
}

impl Sweep {
    /// The settings for `problem`.
    pub fn series(&self, problem: &Problem) -> Vec<Series> {
        let plan = problem.setup.plan(&Accuracy::default());
        let reason = |method: &Method| match &plan {
            Ok(plan) => method.reason_against(problem, plan),
            Err(error) => Some(error.to_string()),
        };
        let methods = methods(problem).into_iter();
        methods
            .map(|method| match reason(&method) {
                Some(reason) => Series { points: Err(reason), method },
                None => Series { points: Ok(self.points(&method)), method },
            })
            .collect()
    }

    /// The settings of `method`.
    fn points(&self, method: &Method) -> Vec<Point> {
        let point = |accuracy| Point { engine: method.engine, accuracy };
        if method.controlled {
            let pairs = self.steps.iter().zip(&self.step_tolerances);
            let controlled =
                |(&step, &tolerance)| Accuracy { step, step_tolerance: Some(tolerance), ..method.accuracy };
            pairs.map(controlled).map(point).collect()
        } else {
            self.steps.iter().map(|&step| point(Accuracy { step, ..method.accuracy })).collect()
        }
    }
}

/// The methods that are compared.
fn methods(problem: &Problem) -> Vec<Method> {
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
    /// Why there is nothing to be learned from it about `problem`, whose steps are those of `plan`.
    fn reason_against(&self, problem: &Problem, plan: &StepPlan) -> Option<String> {
        let base = Accuracy::default();
        let joints = problem.setup.model.joint_count();
        let rows = plan.ground.is_some() || plan.limits.is_some() || plan.dry_friction.is_some();
        let boxed = plan.drive.as_ref().is_some_and(|drive| drive.max_torque.is_some());
        let reason = if self.feedforward.is_some() && !problem.setup.script.has_targets() {
            "no joint is driven toward a target"
        } else if self.accuracy.coordinates != base.coordinates && joints == 0 {
            "the character has no joints: both coordinates are the same"
        } else if self.accuracy.friction_cone != base.friction_cone && plan.friction.is_none() {
            "nothing here has friction"
        } else if self.accuracy.solver != base.solver && !(rows || boxed) {
            "neither contact nor limits: there is nothing to solve"
        } else {
            let faults = self.accuracy.faults();
            let reasons: Vec<String> = faults.iter().map(|fault| fault.reason.clone()).collect();
            return (!reasons.is_empty()).then(|| reasons.join("; "));
        };
        Some(reason.to_owned())
    }
}
