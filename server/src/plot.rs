//! Error against run time as a picture (SVG), both axes logarithmic.

use ovtigre_proto::curve::{Curve, CurveRow};
use plotters::{
    coord::combinators::{BindKeyPoints as _, IntoLogRange as _, LogCoord, WithKeyPoints},
    prelude::*,
};

/// Width and height in pixels.
const SIZE: (u32, u32) = (900, 560);
const COLOURS: [RGBColor; 6] = [
    RGBColor(31, 98, 180),
    RGBColor(214, 96, 20),
    RGBColor(40, 140, 60),
    RGBColor(150, 60, 160),
    RGBColor(120, 80, 40),
    RGBColor(60, 140, 150),
];
const TARGET: RGBColor = RGBColor(190, 30, 45);

type Axis = WithKeyPoints<LogCoord<f64>>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Axis, Axis>>;
type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// What is known of one render. Points are seconds and relative errors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Its name.
    pub name: String,
    /// Errors as they were estimated.
    pub estimated: Vec<[f64; 2]>,
    /// What they are at most.
    pub upper: Vec<[f64; 2]>,
    /// Those of the estimates that are not certified, whatever they are at most.
    pub doubted: Vec<[f64; 2]>,
    /// Errors against a reference.
    pub truth: Vec<[f64; 2]>,
    /// Slope of log error over log time.
    pub slope: Option<f64>,
}

impl Trace {
    /// Of a job's curve.
    pub fn of(name: &str, curve: &Curve) -> Self {
        let points = |of: fn(&CurveRow) -> Option<f64>| -> Vec<[f64; 2]> {
            curve.rows.iter().filter_map(|row| Some([row.wall_seconds, of(row)?])).collect()
        };
        Self {
            name: name.to_owned(),
            estimated: points(|row| row.relative_error),
            upper: points(|row| row.relative_error_upper),
            doubted: points(|row| row.relative_error.filter(|_| row.doubt.is_some())),
            truth: Vec::new(),
            slope: curve.slope,
        }
    }

    fn points(&self) -> impl Iterator<Item = [f64; 2]> {
        let all = self.estimated.iter().chain(&self.upper).chain(&self.truth).copied();
        all.filter(|[t, e]| *t > 0.0 && *e > 0.0 && t.is_finite() && e.is_finite())
    }
}

/// The picture: for each trace its estimates (hollow where they are not certified), a band up to what they are at most, the fitted slope (dashed) and the error against
/// the reference (crosses); the target is a line across.
pub fn svg(title: &str, traces: &[Trace], target: Option<f64>) -> String {
    let mut text = String::new();
    draw(SVGBackend::with_string(&mut text, SIZE), title, traces, target)
        .expect("drawing into memory cannot fail");
    text
}

fn draw(backend: SVGBackend<'_>, title: &str, traces: &[Trace], target: Option<f64>) -> Drawn {
    let root = backend.into_drawing_area();
    root.fill(&WHITE)?;
    let Some([times, errors]) = ranges(traces, target) else {
        let style = ("sans-serif", 20).into_font();
        root.draw(&Text::new(format!("{title}: no error is known yet"), (40, 40), style))?;
        return root.present();
    };
    let mut builder = ChartBuilder::on(&root);
    builder.caption(title, ("sans-serif", 20)).margin(14).x_label_area_size(44).y_label_area_size(66);
    let mut chart = builder.build_cartesian_2d(axis(times), axis(errors))?;
    let mut mesh = chart.configure_mesh();
    mesh.x_desc("run time in seconds").y_desc("relative error").label_style(("sans-serif", 14));
    mesh.light_line_style(RGBColor(238, 238, 238)).bold_line_style(RGBColor(215, 215, 215));
    mesh.x_label_formatter(&number).y_label_formatter(&number).draw()?;
    if let Some(target) = target {
        let line = LineSeries::new([(times[0], target), (times[1], target)], TARGET.stroke_width(2));
        chart
            .draw_series(line)?
            .label(format!("target {}", number(&target)))
            .legend(|(x, y)| PathElement::new([(x, y), (x + 20, y)], TARGET.stroke_width(2)));
    }
    for (trace, colour) in traces.iter().zip(COLOURS.into_iter().cycle()) {
        draw_trace(&mut chart, trace, colour)?;
    }
    let mut legend = chart.configure_series_labels();
    legend.position(SeriesLabelPosition::UpperRight).label_font(("sans-serif", 14));
    legend.background_style(WHITE.mix(0.9)).border_style(RGBColor(200, 200, 200)).draw()?;
    root.present()
}

fn draw_trace(chart: &mut Chart<'_, '_>, trace: &Trace, colour: RGBColor) -> Drawn {
    let positive = |points: &[[f64; 2]]| -> Vec<(f64, f64)> {
        points.iter().map(|p| (p[0], p[1])).filter(|(t, e)| *t > 0.0 && *e > 0.0).collect()
    };
    let (estimated, upper, truth) =
        (positive(&trace.estimated), positive(&trace.upper), positive(&trace.truth));
    let band: Vec<(f64, f64)> = upper.iter().copied().chain(estimated.iter().rev().copied()).collect();
    if upper.len() > 1 {
        chart.draw_series([Polygon::new(band, colour.mix(0.15))])?;
    }
    chart
        .draw_series(LineSeries::new(estimated.iter().copied(), colour.stroke_width(2)))?
        .label(trace.name.clone())
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
    chart.draw_series(estimated.iter().map(|point| Circle::new(*point, 4, colour.filled())))?;
    let doubted = positive(&trace.doubted);
    chart.draw_series(doubted.into_iter().map(|point| Circle::new(point, 3, WHITE.filled())))?;
    if let Some((slope, line)) = trace.slope.and_then(|slope| Some((slope, fit(&estimated, slope)?))) {
        let line = DashedLineSeries::new(line, 7, 5, colour.mix(0.7).stroke_width(1));
        chart
            .draw_series(line)?
            .label(format!("{}: slope {slope:.2}", trace.name))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.mix(0.4).stroke_width(1)));
    }
    if !truth.is_empty() {
        let cross = move |point| Cross::new(point, 5, colour.stroke_width(2));
        let name = format!("{}: against the reference", trace.name);
        chart
            .draw_series(truth.into_iter().map(cross))?
            .label(name)
            .legend(move |(x, y)| Cross::new((x + 10, y), 5, colour.stroke_width(2)));
    }
    Ok(())
}

/// The line of a slope through the middle of points, in logarithms, over the times that they have.
fn fit(points: &[(f64, f64)], slope: f64) -> Option<[(f64, f64); 2]> {
    let (first, last) = (points.first()?.0, points.last()?.0);
    let n = points.len() as f64;
    let x = points.iter().map(|p| p.0.ln()).sum::<f64>() / n;
    let y = points.iter().map(|p| p.1.ln()).sum::<f64>() / n;
    let at = |time: f64| (time, (y + slope * (time.ln() - x)).exp());
    (first < last).then(|| [at(first), at(last)])
}

/// What the axes span: all that is drawn, with some room around.
fn ranges(traces: &[Trace], target: Option<f64>) -> Option<[[f64; 2]; 2]> {
    let points: Vec<[f64; 2]> = traces.iter().flat_map(Trace::points).collect();
    points.first()?;
    let span = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
        [low * 0.8, high * 1.25]
    };
    let errors = points.iter().map(|p| p[1]).chain(target.filter(|t| *t > 0.0));
    Some([span(&mut points.iter().map(|p| p[0])), span(&mut errors.into_iter())])
}

/// A logarithmic axis, with a line at each digit of each power of ten, and labels at as many of them as there is room for.
fn axis([low, high]: [f64; 2]) -> Axis {
    (low..high)
        .log_scale()
        .with_key_points(marks([low, high], labelled(high / low)))
        .with_light_points(marks([low, high], &DIGITS))
}

const DIGITS: [f64; 9] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];

/// What is labelled of each power of ten on an axis whose end is so many times its start.
fn labelled(ratio: f64) -> &'static [f64] {
    match ratio {
        ..3.0 => &[1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
        ..100.0 => &[1.0, 2.0, 3.0, 5.0],
        ..1e4 => &[1.0, 3.0],
        _ => &[1.0],
    }
}

/// The multiples of powers of ten in a range: of all powers, or of each second one and so on where there are more than twelve.
fn marks([low, high]: [f64; 2], digits: &[f64]) -> Vec<f64> {
    let [first, last] = [low, high].map(|value| value.log10().floor() as i32);
    let powers = (first..=last).step_by(1 + (last - first) as usize / 12);
    let all = powers.flat_map(|power| digits.iter().map(move |digit| digit * 10.0_f64.powi(power)));
    all.filter(|mark| (low..=high).contains(mark)).collect()
}

/// A number as short as it can be.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "as labels are formatted")]
fn number(value: &f64) -> String {
    let digits = (1.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trace() -> Trace {
        let points =
            |factor: f64| (0..6).map(|i| f64::from(1 << i)).map(|t| [t, factor / t.sqrt()]).collect();
        Trace {
            name: "room <path>".to_owned(),
            estimated: points(0.1),
            upper: points(0.13),
            doubted: Vec::new(),
            truth: points(0.105),
            slope: Some(-0.5),
        }
    }

    #[test]
    fn all_that_is_known_is_drawn_and_names_are_escaped() {
        let text = svg("room", &[trace()], Some(0.05));
        for part in ["slope -0.50", "room &lt;path&gt;", "target 0.05", "<polygon", "against the reference"] {
            assert!(text.contains(part), "{part} in {text}");
        }
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        assert_eq!(text.matches("<circle").count(), 6);
    }

    #[test]
    fn marks_are_all_over_the_axis_and_each_is_there_once() {
        let close = |found: Vec<f64>, expected: &[f64]| {
            assert_eq!(found.len(), expected.len(), "{found:?}");
            assert!(found.iter().zip(expected).all(|(a, b)| (a / b - 1.0).abs() < 1e-12), "{found:?}");
        };
        let of = |range: [f64; 2]| marks(range, labelled(range[1] / range[0]));
        close(of([0.55, 24.0]), &[1.0, 2.0, 3.0, 5.0, 10.0, 20.0]);
        close(of([0.019, 0.33]), &[0.02, 0.03, 0.05, 0.1, 0.2, 0.3]);
        close(of([1.01, 1.58]), &[1.2, 1.5]);
        close(of([0.02, 90.0]), &[0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0]);
        close(of([0.5, 2e5]), &[1.0, 10.0, 100.0, 1e3, 1e4, 1e5]);
        assert!((1..=12).contains(&of([1e-30, 1e30]).len()));
    }

    #[test]
    fn a_job_without_errors_says_so() {
        for traces in [vec![], vec![Trace::default()]] {
            assert!(svg("room", &traces, Some(0.01)).contains("no error is known yet"));
        }
        let one = Trace { estimated: vec![[1.0, 0.5]], slope: Some(-0.5), ..Trace::default() };
        assert!(svg("room", &[one], None).contains("<circle"));
    }

    #[test]
    fn the_fitted_line_goes_through_the_middle() {
        let points: Vec<(f64, f64)> = trace().estimated.iter().map(|p| (p[0], p[1])).collect();
        let [first, last] = fit(&points, -0.5).unwrap();
        assert!((first.1 - 0.1).abs() < 1e-12 && (last.1 - 0.1 / 32.0_f64.sqrt()).abs() < 1e-12);
    }
}
