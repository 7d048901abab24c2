//! Jobs and motions in words, for the recording.

use super::prepared::PreparedRun;
use super::report::TrainingReport;
use crate::jobs::order::Order;
use crate::jobs::repertoire::RepertoireEntry;
use gaitwright_learning::gait::GaitReport;
use gaitwright_learning::training::LearnedMotion;
use gaitwright_physics::motion::{Metrics, Validity};

/// What a job is about, and what came of it once there is a report, as Markdown.
pub(super) fn describe(order: &Order, prepared: &PreparedRun, report: Option<&TrainingReport>) -> String {
    let (character, setup) = (&order.reading.character, &prepared.setup);
    let mut text = format!("# {}\n\n", character.name);
    if let Some(report) = report {
        text += &outcome(report);
    }
    text += &format!("The character {}.\n\n", prepared.teaching());
    let time = 1000.0 * setup.parameters.transition_time;
    text += &format!(
        "{:.2} kg, {} joints, seed {}, transitions of {time:.0} ms\n\n| effect | | because |\n|---|---|---|\n",
        setup.model.mass,
        setup.model.joint_count(),
        setup.seed,
    );
    for (effect, decision) in &prepared.plan.decisions {
        let state = if decision.on { "on" } else { "off" };
        text += &format!("| {} | {state} | {} |\n", effect.name(), decision.because);
    }
    text
}

fn outcome(report: &TrainingReport) -> String {
    match (&report.metrics, &report.unsuccessful) {
        (Some(metrics), _) => format!(
            "**{:.2} m/s**, upright for {:.1} s, gait {}, after {} generations{}\n\n",
            metrics.speed,
            metrics.upright_seconds,
            metrics.gait.as_deref().unwrap_or("without a name"),
            report.generations,
            doubts(&metrics.validity),
        ),
        (None, Some(reason)) => format!("{reason}\n\n"),
        (None, None) => String::new(),
    }
}

/// Why the motion cannot be relied on, if so.
fn doubts(validity: &Validity) -> String {
    match (validity.valid, validity.unsolved_steps) {
        (true, _) => String::new(),
        (false, 0) => "; **not valid**: it did not last to the end of its check".to_owned(),
        (false, steps) => format!("; **not valid**: {steps} steps of its check are unsolved"),
    }
}

/// Whether a motion is natural, and if not, which measures do not hold.
fn verdict(metrics: &Metrics) -> String {
    if metrics.natural {
        return "natural".to_owned();
    }
    let broken = metrics.naturalness.iter().filter(|(_, measure)| !measure.holds);
    let broken: Vec<String> = broken.map(|(name, measure)| format!("{name} {:.3}", measure.value)).collect();
    if broken.is_empty() { "not natural".to_owned() } else { format!("not natural: {}", broken.join(", ")) }
}

/// A motion that the search has come to by now, and what its check says of it, as Markdown.
pub(super) fn describe_on_the_way(motion: &LearnedMotion, gait: &GaitReport) -> String {
    format!(
        "# {}\n\non the way, at generation {}: {}, {:.2} m/s, {}",
        motion.name,
        motion.behaviour.generation,
        gait.gait.as_deref().unwrap_or("without a name"),
        gait.speed,
        if gait.natural { "natural" } else { "not natural" },
    )
}

/// A motion that the search has come to by now and that was not played to its end, as Markdown.
pub(super) fn describe_slow(motion: &LearnedMotion) -> String {
    let LearnedMotion { name, behaviour, .. } = motion;
    format!(
        "# {name}\n\non the way, at generation {}: its beginning, for all of it would take too long",
        behaviour.generation
    )
}

/// A motion in figures, as Markdown.
pub(super) fn describe_motion(entry: &RepertoireEntry) -> String {
    let metrics = &entry.metrics;
    let mut text = format!("# {}\n\n", entry.name);
    let figure = |value: Option<f64>| value.map_or("–".to_owned(), |value| format!("{value:.2}"));
    text += &format!(
        "**{}**\n\n| | |\n|---|---|\n| gait | {} |\n| speed | {:.2} m/s |\n| Froude number | {} |\n| cost of transport | {} |\n",
        verdict(metrics),
        metrics.gait.as_deref().unwrap_or("without a name"),
        metrics.speed,
        figure(metrics.froude),
        figure(metrics.cost_of_transport),
    );
    text
}
