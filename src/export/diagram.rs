//! Hildebrand's gait diagram as SVG: a row a foot, a bar a stance.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use gaitwright_learning::gait::{Foot, GaitReport};

/// Strides that are shown.
const STRIDES: f64 = 5.0;
/// Shown of a motion without strides, s.
const WITHOUT_STRIDES: f64 = 3.0;
const WIDTH: u32 = 900;
const ROW: u32 = 36;
const LEFT: u32 = 150;
const RIGHT: u32 = 130;
const TOP: u32 = 64;
const BOTTOM: u32 = 44;
pub(super) const INK: RGBColor = RGBColor(40, 44, 52);
pub(super) const FAINT: RGBColor = RGBColor(214, 218, 224);
const BARS: [RGBColor; 6] = [
    RGBColor(46, 109, 164),
    RGBColor(200, 120, 20),
    RGBColor(20, 130, 100),
    RGBColor(190, 80, 60),
    RGBColor(130, 80, 150),
    RGBColor(90, 100, 40),
];

/// A diagram that cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[error("cannot draw the diagram: {0}")]
pub struct DiagramError(String);

/// Draws the last strides of a gait: time to the right, a row for each foot in the order of the
/// report, bars where it stands, faint lines at the touch-downs of the reference foot, duty factor and
/// phase at the right.
///
/// # Errors
///
/// [`DiagramError`] when the drawing library fails.
pub fn gait_diagram(report: &GaitReport) -> Result<String, DiagramError> {
    let height = TOP + BOTTOM + ROW * report.feet.len().max(1) as u32;
    drawn((WIDTH, height), |area| draw(area, report, height))
}

/// What is drawn on.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// The SVG of `size` pixels that `draw` draws.
pub(super) fn drawn(size: (u32, u32), draw: impl FnOnce(&Area<'_>) -> Drawn) -> Result<String, DiagramError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        draw(&area).map_err(|error| DiagramError(error.to_string()))?;
        area.present().map_err(|error| DiagramError(error.to_string()))?;
    }
    Ok(svg)
}

fn draw(area: &Area<'_>, report: &GaitReport, height: u32) -> Drawn {
    area.fill(&WHITE)?;
    let (from, to) = window(report);
    let bottom = (height - BOTTOM) as i32;
    let x = |time: f64| {
        let part = ((time - from) / (to - from)).clamp(0.0, 1.0);
        LEFT as i32 + (part * f64::from(WIDTH - LEFT - RIGHT)).round() as i32
    };
    label(area, &title(report), (20, 24), 20.0, HPos::Left)?;
    label(area, &subtitle(report), (20, 46), 13.0, HPos::Left)?;

    let reference = report.feet.iter().find(|foot| foot.phase.is_some());
    for stance in reference.iter().flat_map(|foot| &foot.stances) {
        if (from..=to).contains(&stance[0]) {
            let at = x(stance[0]);
            area.draw(&PathElement::new([(at, TOP as i32), (at, bottom)], FAINT.stroke_width(1)))?;
        }
    }
    for (row, foot) in report.feet.iter().enumerate() {
        let top = (TOP + ROW * row as u32) as i32;
        let middle = top + ROW as i32 / 2;
        label(area, &name(foot), (LEFT as i32 - 10, middle), 14.0, HPos::Right)?;
        label(area, &figures(foot), ((WIDTH - RIGHT) as i32 + 10, middle), 13.0, HPos::Left)?;
        let color = BARS[row % BARS.len()].filled();
        for &[start, end] in foot.stances.iter().filter(|stance| stance[1] > from && stance[0] < to) {
            let corners = [(x(start), top + 7), (x(end), top + ROW as i32 - 7)];
            area.draw(&Rectangle::new(corners, color))?;
        }
    }
    axis(area, (from, to), bottom, x)
}

/// The time axis, with a mark at every multiple of a round interval.
fn axis(area: &Area<'_>, (from, to): (f64, f64), bottom: i32, x: impl Fn(f64) -> i32) -> Drawn {
    area.draw(&PathElement::new([(x(from), bottom), (x(to), bottom)], INK.stroke_width(1)))?;
    let interval = round_interval((to - from) / 8.0);
    let first = (from / interval).ceil() as i64;
    for mark in first..=(to / interval).floor() as i64 {
        let time = mark as f64 * interval;
        let at = x(time);
        area.draw(&PathElement::new([(at, bottom), (at, bottom + 5)], INK.stroke_width(1)))?;
        let digits = (-interval.log10()).ceil().max(0.0) as usize;
        label(area, &format!("{time:.digits$}"), (at, bottom + 14), 12.0, HPos::Center)?;
    }
    label(area, "time, s", ((x(from) + x(to)) / 2, bottom + 32), 12.0, HPos::Center)
}

/// The last strides of the motion, or its last seconds, s.
fn window(report: &GaitReport) -> (f64, f64) {
    let [start, end] = report.span;
    let shown = report.stride_period.map_or(WITHOUT_STRIDES, |period| STRIDES * period);
    let from = (end - shown).max(start);
    // Nothing to show is shown over a second.
    if end > from { (from, end) } else { (from, from + 1.0) }
}

/// The smallest of 1, 2, 5 times a power of ten that is at least `least`.
fn round_interval(least: f64) -> f64 {
    let decade = 10_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0].iter().map(|factor| factor * decade).find(|&step| step >= least).unwrap_or(10.0 * decade)
}

fn title(report: &GaitReport) -> String {
    let gait = report.gait.as_deref().unwrap_or("gait");
    format!("{gait}, {:.2} m/s", report.speed)
}

fn subtitle(report: &GaitReport) -> String {
    let mut figures = Vec::new();
    if let Some(period) = report.stride_period {
        figures.push(format!("stride {period:.3} s"));
    }
    figures.push(format!("aloft {:.0} %", 100.0 * report.aerial_fraction));
    if let Some(froude) = report.froude {
        figures.push(format!("Froude {froude:.2}"));
    }
    if let Some(cost) = report.cost_of_transport {
        figures.push(format!("cost of transport {cost:.2}"));
    }
    figures.join(" · ")
}

fn name(foot: &Foot) -> String {
    match &foot.leg {
        Some(leg) => format!("{} {leg}", shortened(&foot.link)),
        None => shortened(&foot.link),
    }
}

/// A link's name, cut to what fits beside the diagram.
fn shortened(name: &str) -> String {
    const FITS: usize = 14;
    if name.chars().count() <= FITS {
        return name.to_owned();
    }
    let start: String = name.chars().take(FITS - 1).collect();
    format!("{start}…")
}

fn figures(foot: &Foot) -> String {
    let duty = format!("β {:.2}", foot.duty_factor);
    foot.phase.map_or_else(|| duty.clone(), |phase| format!("{duty}   φ {phase:.2}"))
}

/// Writes `text` with the middle of its line at `at`.
pub(super) fn label(area: &Area<'_>, text: &str, at: (i32, i32), size: f64, anchor: HPos) -> Drawn {
    let style = ("sans-serif", size).into_font().color(&INK).pos(Pos::new(anchor, VPos::Center));
    area.draw(&Text::new(text, at, style))
}
