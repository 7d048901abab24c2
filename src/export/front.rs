//! The work-precision diagram as SVG: error against computing time, a line a method, the front behind them.

use plotters::element::PathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::diagram::{Area, DiagramError, Drawn, FAINT, INK, drawn, label};
use gaitwright_learning::accuracy::{Engine, Figures, RowStatus, Table, TableRow};

const WIDTH: u32 = 960;
const HEIGHT: u32 = 580;
const LEFT: i32 = 84;
const RIGHT: i32 = 640;
const TOP: i32 = 92;
const BOTTOM: i32 = 520;
/// Height of a line of the legend.
const LINE: i32 = 22;
const FRONT: RGBColor = RGBColor(255, 205, 90);
const COLORS: [RGBColor; 8] = [
    RGBColor(31, 95, 160),
    RGBColor(200, 95, 15),
    RGBColor(20, 130, 90),
    RGBColor(170, 45, 75),
    RGBColor(120, 75, 165),
    RGBColor(110, 95, 30),
    RGBColor(20, 140, 160),
    RGBColor(95, 100, 110),
];

/// Draws what every setting of a study costs and how exact it is, both on logarithmic axes: a line and a mark of
/// its own for each method, a thin line from the lower to the upper quartile of its errors, a broad band behind the settings that none other beats, a cross at the upper edge
/// for each that diverged. Settings that simulate a variant of the subject, and those that were left out, are
/// not drawn.
///
/// # Errors
///
/// [`DiagramError`] when the drawing library fails.
pub fn front_diagram(table: &Table) -> Result<String, DiagramError> {
    drawn((WIDTH, HEIGHT), |area| draw(area, table))
}

/// What a row shows: computing time and error, neither of them 0, which has no place on a logarithmic axis.
fn place(row: &TableRow) -> Option<(f64, f64)> {
    let figures: &Figures = row.comparable()?;
    (figures.seconds > 0.0 && figures.error > 0.0).then_some((figures.seconds, figures.error))
}

/// The quartiles of a row's errors.
fn whisker(row: &TableRow) -> Option<[f64; 2]> {
    place(row)?;
    row.figures.as_ref().map(|figures| [figures.spread.lower_quartile, figures.spread.upper_quartile])
}

fn draw(area: &Area<'_>, table: &Table) -> Drawn {
    area.fill(&WHITE)?;
    let title = format!("{}: what accuracy costs", table.subject.name);
    label(area, &title, (20, 24), 20.0, HPos::Left)?;
    label(area, &table.subject.error, (20, 48), 13.0, HPos::Left)?;
    let shown: Vec<(f64, f64)> = table.rows.iter().filter_map(place).collect();
    let x = Axis::new(shown.iter().map(|(seconds, _)| *seconds), (LEFT, RIGHT));
    let ends = table.rows.iter().filter_map(whisker).flatten().filter(|error| *error > 0.0);
    let errors: Vec<f64> = shown.iter().map(|(_, error)| *error).chain(ends).collect();
    let y = Axis::new(errors.iter().copied(), (BOTTOM, TOP));
    axes(area, &x, &y, &table.subject.unit)?;
    let at = |(seconds, error): (f64, f64)| (x.at(seconds), y.at(error));

    let mut front: Vec<(f64, f64)> = table.rows.iter().filter(|row| row.front).filter_map(place).collect();
    front.sort_by(|one, other| one.0.total_cmp(&other.0));
    let band: Vec<(i32, i32)> = front.iter().map(|point| at(*point)).collect();
    area.draw(&PathElement::new(band, FRONT.stroke_width(11)))?;

    let mut line = 0;
    for rows in table.rows.chunk_by(|one, other| one.method == other.method) {
        let points: Vec<(i32, i32)> = rows.iter().filter_map(place).map(at).collect();
        let lost =
            rows.iter().filter(|row| row.status == RowStatus::Diverged && row.feedforward.is_none()).count();
        if points.is_empty() && lost == 0 {
            continue;
        }
        let series = Look::new(line as usize, rows[0].engine);
        for (row, [lower, upper]) in rows.iter().filter_map(|row| Some((row, whisker(row)?))) {
            let Some((seconds, error)) = place(row) else { continue };
            let lower = if lower > 0.0 { lower } else { error.min(upper) };
            let ends = [at((seconds, lower)), at((seconds, upper))];
            area.draw(&PathElement::new(ends, series.color.mix(0.6).stroke_width(1)))?;
        }
        area.draw(&PathElement::new(points.clone(), series.color.stroke_width(series.width)))?;
        for point in points {
            series.mark(area, point)?;
        }
        let row = TOP + 8 + LINE * line;
        line += 1;
        let (from, to) = (RIGHT + 24, RIGHT + 56);
        area.draw(&PathElement::new([(from, row), (to, row)], series.color.stroke_width(series.width)))?;
        series.mark(area, ((from + to) / 2, row))?;
        let text = match lost {
            0 => rows[0].method.clone(),
            _ => format!("{} (× {lost} diverged)", rows[0].method),
        };
        label(area, &text, (to + 8, row), 13.0, HPos::Left)?;
    }
    let row = TOP + 8 + LINE * line;
    area.draw(&PathElement::new([(RIGHT + 24, row), (RIGHT + 56, row)], FRONT.stroke_width(11)))?;
    label(area, "the front: none is both faster and more exact", (RIGHT + 64, row), 13.0, HPos::Left)?;
    let row = row + LINE;
    area.draw(&PathElement::new(
        [(RIGHT + 40, row - 8), (RIGHT + 40, row + 8)],
        INK.mix(0.6).stroke_width(1),
    ))?;
    let text = format!("half of the {} pieces (quartiles); marks: the mean", table.subject.compared);
    label(area, &text, (RIGHT + 64, row), 13.0, HPos::Left)
}

/// How a method looks.
struct Look {
    color: RGBColor,
    shape: usize,
    width: u32,
}

impl Look {
    fn new(number: usize, engine: Engine) -> Self {
        let width = if engine == Engine::Gaitwright { 2 } else { 3 };
        Self { color: COLORS[number % COLORS.len()], shape: (number / COLORS.len() + number) % 4, width }
    }

    fn mark(&self, area: &Area<'_>, (x, y): (i32, i32)) -> Drawn {
        let fill = self.color.filled();
        match self.shape {
            0 => area.draw(&Circle::new((x, y), 4, fill)),
            1 => area.draw(&Rectangle::new([(x - 4, y - 4), (x + 4, y + 4)], fill)),
            2 => area.draw(&Polygon::new([(x, y - 5), (x + 5, y + 4), (x - 5, y + 4)], fill)),
            _ => area.draw(&Polygon::new([(x, y - 5), (x + 5, y), (x, y + 5), (x - 5, y)], fill)),
        }
    }
}

/// A logarithmic axis over whole decades.
struct Axis {
    /// Powers of ten at its ends.
    decades: (i32, i32),
    /// Places of its ends.
    ends: (i32, i32),
}

impl Axis {
    fn new(values: impl Iterator<Item = f64> + Clone, ends: (i32, i32)) -> Self {
        let lowest = values.clone().fold(f64::INFINITY, f64::min).log10().floor();
        let highest = values.fold(0.0, f64::max).log10().ceil();
        let decades = if lowest.is_finite() && highest.is_finite() {
            (lowest as i32, (highest as i32).max(lowest as i32 + 1))
        } else {
            (-3, 0)
        };
        Self { decades, ends }
    }

    fn at(&self, value: f64) -> i32 {
        let (from, to) = (f64::from(self.decades.0), f64::from(self.decades.1));
        let part = (value.log10() - from) / (to - from);
        self.ends.0 + (part * f64::from(self.ends.1 - self.ends.0)).round() as i32
    }

    fn marks(&self) -> impl Iterator<Item = (i32, i32)> + '_ {
        (self.decades.0..=self.decades.1).map(|power| (power, self.at(10_f64.powi(power))))
    }
}

/// Frame, decades and names of both axes.
fn axes(area: &Area<'_>, x: &Axis, y: &Axis, unit: &str) -> Drawn {
    for (power, at) in x.marks() {
        area.draw(&PathElement::new([(at, TOP), (at, BOTTOM)], FAINT.stroke_width(1)))?;
        label(area, &decade(power), (at, BOTTOM + 16), 12.0, HPos::Center)?;
    }
    for (power, at) in y.marks() {
        area.draw(&PathElement::new([(LEFT, at), (RIGHT, at)], FAINT.stroke_width(1)))?;
        label(area, &decade(power), (LEFT - 8, at), 12.0, HPos::Right)?;
    }
    area.draw(&PathElement::new([(LEFT, TOP), (LEFT, BOTTOM), (RIGHT, BOTTOM)], INK.stroke_width(1)))?;
    let middle = (LEFT + RIGHT) / 2;
    label(area, "computing time for a simulated second, s", (middle, BOTTOM + 40), 13.0, HPos::Center)?;
    label(area, &format!("error, {unit}"), (LEFT - 8, TOP - 14), 13.0, HPos::Center)
}

fn decade(power: i32) -> String {
    format!("1e{power}")
}
