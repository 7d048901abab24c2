//! What the variants of a search cost over simulated time, as SVG: a line a variant, with a band from least to greatest.

use plotters::element::PathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::diagram::{Area, DiagramError, Drawn, FAINT, INK, drawn, label};
use gaitwright_learning::program::cost::HOLDS;
use gaitwright_learning::study::{LearningTable, VariantRow};

const WIDTH: u32 = 960;
const HEIGHT: u32 = 560;
const LEFT: i32 = 74;
const RIGHT: i32 = 620;
const TOP: i32 = 84;
const BOTTOM: i32 = 500;
/// Height of a line of the legend.
const LINE: i32 = 22;
/// Places along the time axis at which lines are drawn.
const PLACES: usize = 240;
const COLORS: [RGBColor; 10] = [
    RGBColor(31, 95, 160),
    RGBColor(200, 95, 15),
    RGBColor(20, 130, 90),
    RGBColor(170, 45, 75),
    RGBColor(120, 75, 165),
    RGBColor(110, 95, 30),
    RGBColor(20, 140, 160),
    RGBColor(95, 100, 110),
    RGBColor(215, 130, 175),
    RGBColor(30, 30, 40),
];

/// Draws what the best motion of each variant of a question costs as a natural gait over simulated time: the median of its
/// runs as a line, from the least to the greatest as a band. Runs that have not found anything yet are at the upper edge.
///
/// # Errors
///
/// [`DiagramError`] when the drawing library fails.
pub fn course_diagram(table: &LearningTable, question: &str) -> Result<String, DiagramError> {
    drawn((WIDTH, HEIGHT), |area| draw(area, table, question))
}

fn draw(area: &Area<'_>, table: &LearningTable, question: &str) -> Drawn {
    area.fill(&WHITE)?;
    let rows = table.answers(question);
    let about = table.questions.get(question).map_or(question, String::as_str);
    let task = &table.task;
    label(area, about, (20, 24), 20.0, HPos::Left)?;
    let asked = format!(
        "{} at Froude number {}: cost as a natural gait, median and range of {} runs; from {HOLDS} on a constraint is broken",
        task.character, task.froude, task.seeds
    );
    label(area, &asked, (20, 48), 13.0, HPos::Left)?;
    let (x, y) = (TimeAxis::new(&rows), CostAxis::new(&rows));
    axes(area, &x, &y)?;
    for (row, color) in rows.iter().zip(COLORS.iter().cycle()) {
        band(area, row, *color, &x, &y)?;
    }
    for (line, (row, color)) in rows.iter().zip(COLORS.iter().cycle()).enumerate() {
        let points = course(row, &x).map(|(at, cost)| (x.at(at), y.at(cost.median)));
        area.draw(&PathElement::new(points.collect::<Vec<_>>(), color.stroke_width(2)))?;
        let at = TOP + 8 + LINE * line as i32;
        area.draw(&PathElement::new([(RIGHT + 24, at), (RIGHT + 50, at)], color.stroke_width(3)))?;
        let natural = match row.natural {
            0 => String::new(),
            count => format!(", {count} natural"),
        };
        label(area, &format!("{}{natural}", row.variant), (RIGHT + 58, at), 13.0, HPos::Left)?;
    }
    Ok(())
}

/// Places along the part of the time axis that a row's runs take, with its cost there.
fn course<'a>(
    row: &'a VariantRow,
    x: &TimeAxis,
) -> impl Iterator<Item = (f64, gaitwright_learning::study::MedianRange)> + 'a {
    let end = row.simulated_seconds;
    let length = x.end;
    (0..=PLACES)
        .map(move |place| length * place as f64 / PLACES as f64)
        .take_while(move |at| *at <= end)
        .map(|at| (at, row.cost_after(at)))
}

fn band(area: &Area<'_>, row: &VariantRow, color: RGBColor, x: &TimeAxis, y: &CostAxis) -> Drawn {
    let mut outline: Vec<(i32, i32)> =
        course(row, x).map(|(at, cost)| (x.at(at), y.at(cost.greatest))).collect();
    let lower: Vec<(i32, i32)> = course(row, x).map(|(at, cost)| (x.at(at), y.at(cost.least))).collect();
    outline.extend(lower.into_iter().rev());
    area.draw(&Polygon::new(outline, color.mix(0.1).filled()))
}

/// Simulated time, from 0.
struct TimeAxis {
    end: f64,
}

impl TimeAxis {
    fn new(rows: &[&VariantRow]) -> Self {
        Self { end: rows.iter().map(|row| row.simulated_seconds).fold(1.0, f64::max) }
    }

    fn at(&self, seconds: f64) -> i32 {
        LEFT + (seconds / self.end * f64::from(RIGHT - LEFT)).round() as i32
    }
}

/// Cost, logarithmic.
struct CostAxis {
    /// Decimal logarithms of its ends.
    ends: [f64; 2],
}

impl CostAxis {
    fn new(rows: &[&VariantRow]) -> Self {
        let costs = || {
            let runs = rows.iter().flat_map(|row| &row.runs);
            runs.flat_map(|run| run.course.iter().map(|[_, cost]| cost.max(0.01)))
        };
        let least = costs().fold(f64::INFINITY, f64::min);
        let greatest = costs().fold(0.0, f64::max);
        if least > greatest {
            return Self { ends: [0.0, 3.0] };
        }
        Self { ends: [least.log10() - 0.1, greatest.log10() + 0.15] }
    }

    /// What is missing is at the upper edge.
    fn at(&self, cost: Option<f64>) -> i32 {
        let [low, high] = self.ends;
        let value = cost.map_or(high, |cost| cost.max(0.01).log10());
        BOTTOM - ((value - low) / (high - low) * f64::from(BOTTOM - TOP)).round() as i32
    }
}

fn axes(area: &Area<'_>, x: &TimeAxis, y: &CostAxis) -> Drawn {
    for part in 0..=4 {
        let seconds = x.end * f64::from(part) / 4.0;
        let at = x.at(seconds);
        area.draw(&PathElement::new([(at, TOP), (at, BOTTOM)], FAINT.stroke_width(1)))?;
        label(area, &format!("{seconds:.0}"), (at, BOTTOM + 16), 12.0, HPos::Center)?;
    }
    let [low, high] = y.ends;
    for power in low.floor() as i32..=high.ceil() as i32 {
        for factor in [1.0, 2.0, 5.0] {
            let cost = factor * 10_f64.powi(power);
            if (low..=high).contains(&cost.log10()) {
                let at = y.at(Some(cost));
                area.draw(&PathElement::new([(LEFT, at), (RIGHT, at)], FAINT.stroke_width(1)))?;
                label(area, &cost.to_string(), (LEFT - 8, at), 12.0, HPos::Right)?;
            }
        }
    }
    area.draw(&PathElement::new([(LEFT, TOP), (LEFT, BOTTOM), (RIGHT, BOTTOM)], INK.stroke_width(1)))?;
    label(area, "simulated time of a run, s", ((LEFT + RIGHT) / 2, BOTTOM + 38), 13.0, HPos::Center)
}
