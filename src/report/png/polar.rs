//! The polar diagram of a luminaire: intensity over γ in the sections C0/C180 and C90/C270.
//!
//! The nadir is below, C0 and C90 are to the right.

use maud::{Markup, html};

use super::canvas::{BOLD, NORMAL, SMALL, TITLE};
use super::drawing::{Anchor, Drawing, Role, corners};
use super::scale::Scale;
use crate::luminaire::intensity::Intensity;
use crate::luminaire::photometry::{Photometry, Symmetry};
use crate::report::luminaire::Figures;
use crate::text::number::short;

/// Width of the diagram, pixels.
const WIDTH: f64 = 860.0;
/// Radius of the outermost circle, pixels.
const RADIUS: f64 = 330.0;
/// Top of the circles.
const TOP: f64 = 150.0;
/// The same without a title.
const UNTITLED_TOP: f64 = 56.0;
/// Side of a small diagram, pixels.
const SMALL_SIZE: f64 = 160.0;
/// Distance of a curve's points at least, pixels: in a diagram, and in a small one.
const FINE: f64 = 0.05;
const COARSE: f64 = 0.8;
/// Height above the horizon that is shown where nothing shines up.
const SLIVER: f64 = 30.0;
/// Lengths of the dashes of the second section and of the gaps between them.
const DASH: [f64; 2] = [14.0, 7.0];

/// The sections and their colours.
const SECTIONS: [(&str, Role); 2] = [("C0/C180", Role::First), ("C90/C270", Role::Second)];

/// What lies at the left and at the right.
const SIDES: [&str; 2] = ["C180, C270", "C0, C90"];

/// Draws a luminaire's diagram; `titled`, with its name and a line about it.
pub(crate) fn diagram(photometry: &Photometry, figures: &Figures, titled: bool) -> Drawing {
    let up = figures.down < 0.999;
    let top = if titled { TOP } else { UNTITLED_TOP };
    let centre = [WIDTH / 2.0, top + if up { RADIUS } else { SLIVER }];
    let foot = centre[1] + RADIUS + 46.0;
    let name = if photometry.name.is_empty() { "luminaire" } else { &photometry.name };
    let description = format!("Polar diagram of the luminous intensity of {name}");
    let sections = sections(photometry);
    let mut drawing = Drawing::new([WIDTH, foot + 32.0 + 32.0 * sections as f64], description);
    if titled {
        head(&mut drawing, photometry, figures, name);
    }
    let scale = Scale::new(0.0, figures.largest[0], 4.0);
    grid(&mut drawing, centre, &scale, up);
    if sections > 1 {
        for (x, side, anchor) in [(32.0, SIDES[0], Anchor::Start), (WIDTH - 32.0, SIDES[1], Anchor::End)] {
            drawing.text([x, top - 26.0], side, NORMAL, anchor, Role::Quiet);
        }
    }
    for (section, (_, role)) in SECTIONS.into_iter().enumerate().take(sections) {
        let pixels = RADIUS / outermost(&scale);
        let curve = curve(&photometry.intensity, 90.0 * section as f64, centre, pixels, FINE);
        if section == 0 {
            drawing.line(curve, true, 3.0, role);
        } else {
            dashes(&curve).into_iter().for_each(|dash| drawing.line(dash, false, 3.0, role));
        }
    }
    key(&mut drawing, figures, foot, sections);
    drawing
}

/// How many sections a diagram shows: a second one that is the same as the first isn't drawn.
fn sections(photometry: &Photometry) -> usize {
    if photometry.symmetry == Symmetry::Rotational { 1 } else { 2 }
}

/// A diagram the size of a stamp, without words, as an element of a page that has [`STYLE`](super::drawing::STYLE).
pub(crate) fn small(photometry: &Photometry, figures: &Figures, description: &str) -> Markup {
    let radius = SMALL_SIZE / 2.0 - 4.0;
    let curve = |section: usize| {
        let pixels = radius / figures.largest[0].max(1e-300);
        corners(&curve(&photometry.intensity, 90.0 * section as f64, [0.0; 2], pixels, COARSE))
    };
    html! {
        svg class="drawing" viewBox=(format!("{0} {0} {SMALL_SIZE} {SMALL_SIZE}", -SMALL_SIZE / 2.0)) role="img"
            aria-label=(description) {
            g fill="none" class="stroke-grid" {
                circle r=(radius.to_string()) {}
                circle r=((radius / 2.0).to_string()) {}
                path d=(format!("M-{radius},0H{radius}M0,-{radius}V{radius}")) {}
            }
            // The second below the first, which is the one to compare.
            @for (section, (_, role)) in SECTIONS.into_iter().enumerate().take(sections(photometry)).rev() {
                polygon points=(curve(section)) fill="none" class=(role.stroke()) stroke-width="1.6"
                    stroke-linejoin="round" stroke-dasharray=[(section == 1).then_some("5 3")] {}
            }
        }
        "\n"
    }
}

/// Value of the outermost circle: the first tick that is no less than the largest intensity.
fn outermost(scale: &Scale) -> f64 {
    (scale.high / scale.step - 1e-9).ceil() * scale.step
}

/// The curve of a section, from the zenith over the first plane's side and the nadir back, pixels; points nearer than
/// `least` to the one before are left out.
fn curve(intensity: &Intensity, c: f64, centre: [f64; 2], pixels: f64, least: f64) -> Vec<[f64; 2]> {
    let mut angles: Vec<f64> = intensity.angles().to_vec();
    angles.extend((0..=360).map(|half| 0.5 * f64::from(half)));
    let (first, last) = (intensity.angles()[0], intensity.angles()[intensity.angles().len() - 1]);
    angles.extend([first - 1e-6, last + 1e-6].into_iter().filter(|gamma| (0.0..=180.0).contains(gamma)));
    angles.sort_by(f64::total_cmp);
    let place = |c: f64, gamma: f64, side: f64| {
        let (sin, cos) = gamma.to_radians().sin_cos();
        let length = intensity.at(c, gamma) * pixels;
        [centre[0] + side * length * sin, centre[1] + length * cos]
    };
    let right = angles.iter().rev().map(|&gamma| place(c, gamma, 1.0));
    let left = angles.iter().map(|&gamma| place(c + 180.0, gamma, -1.0));
    let mut points: Vec<[f64; 2]> = right.chain(left).collect();
    points.dedup_by(|next, kept| (next[0] - kept[0]).hypot(next[1] - kept[1]) < least);
    points
}

/// A closed curve cut into dashes.
fn dashes(curve: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
    let closed = curve.iter().chain(curve.first()).copied().collect::<Vec<_>>();
    let mut dashes: Vec<Vec<[f64; 2]>> = vec![closed.first().copied().into_iter().collect()];
    let (mut drawing, mut left) = (true, DASH[0]);
    for pair in closed.windows(2) {
        let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
        let length = (x1 - x0).hypot(y1 - y0);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let at = [x0 + (x1 - x0) * done / length, y0 + (y1 - y0) * done / length];
            match dashes.last_mut() {
                Some(dash) if drawing => dash.push(at),
                _ => dashes.push(vec![at]),
            }
            drawing = !drawing;
            left = DASH[usize::from(!drawing)];
        }
        left -= length - done;
        if let Some(dash) = dashes.last_mut().filter(|_| drawing) {
            dash.push([x1, y1]);
        }
    }
    dashes.retain(|dash| dash.len() > 1);
    dashes
}

/// Title, and the luminaire in a line.
fn head(drawing: &mut Drawing, photometry: &Photometry, figures: &Figures, name: &str) {
    let room = ((WIDTH - 64.0) / f64::from(TITLE.width("x"))) as usize;
    drawing.text([32.0, 44.0], shortened(name, room), TITLE, Anchor::Start, Role::Text);
    let mut facts = vec![photometry.manufacturer.clone(), photometry.catalogue.clone()];
    facts.push(photometry.format.name().into());
    facts.push(format!("{} lm", short(figures.flux)));
    if let Some(power) = photometry.power {
        facts.push(format!("{} W, {} lm/W", short(power), short(figures.flux / power)));
    }
    facts.retain(|fact| !fact.is_empty());
    let room = ((WIDTH - 64.0) / f64::from(NORMAL.width("x"))) as usize;
    drawing.text([32.0, 84.0], shortened(&facts.join(" · "), room), NORMAL, Anchor::Start, Role::Quiet);
}

/// Circles of equal intensity, rays of equal γ.
fn grid(drawing: &mut Drawing, [x, y]: [f64; 2], scale: &Scale, up: bool) {
    let highest = if up { 180 } else { 90 };
    let ticks = (1..=(outermost(scale) / scale.step).round() as usize).map(|tick| tick as f64 * scale.step);
    for tick in ticks.clone() {
        let radius = RADIUS * tick / outermost(scale);
        let arc = (-highest..=highest).map(|degree| {
            let (sin, cos) = f64::from(degree).to_radians().sin_cos();
            [x + radius * sin, y + radius * cos]
        });
        let points = arc.collect();
        drawing.line(points, up, 1.0, Role::Grid);
    }
    for gamma in (0..=highest).step_by(30) {
        let (sin, cos) = f64::from(gamma).to_radians().sin_cos();
        let sides: &[f64] = if gamma % 180 == 0 { &[1.0] } else { &[1.0, -1.0] };
        for side in sides {
            drawing.line(vec![[x, y], [x + side * RADIUS * sin, y + RADIUS * cos]], false, 1.0, Role::Grid);
            let [away, along] = [RADIUS + 32.0, RADIUS + 22.0];
            drawing.text(
                [x + side * away * sin, y + along * cos],
                format!("{gamma}°"),
                NORMAL,
                Anchor::Middle,
                Role::Quiet,
            );
        }
    }
    for tick in ticks {
        let (sin, cos) = 15_f64.to_radians().sin_cos();
        let radius = RADIUS * tick / outermost(scale);
        let label = scale.label(tick);
        drawing.text([x + radius * sin + 4.0, y + radius * cos - 10.0], label, SMALL, Anchor::Start, Role::Text);
    }
    drawing.text([32.0, y + RADIUS], "I, cd", BOLD, Anchor::Start, Role::Text);
}

/// Which line is which section, and its angles.
fn key(drawing: &mut Drawing, figures: &Figures, top: f64, sections: usize) {
    for (section, (name, role)) in SECTIONS.into_iter().enumerate().take(sections) {
        let y = top + 20.0 + 32.0 * section as f64;
        if section == 0 {
            drawing.line(vec![[32.0, y], [80.0, y]], false, 3.0, role);
        } else {
            for x in [32.0, 66.0] {
                drawing.line(vec![[x, y], [x + DASH[0], y]], false, 3.0, role);
            }
        }
        let name = if sections == 1 { "all C" } else { name };
        let [beam, field] = [figures.beam[section], figures.field[section]].map(|spread| short(spread.angle().round()));
        let text = format!("{name}: beam {beam}° (50 %), field {field}° (10 %)");
        drawing.text([96.0, y], text, NORMAL, Anchor::Start, Role::Text);
    }
}

/// A text of so many letters at most.
fn shortened(text: &str, letters: usize) -> String {
    if text.chars().count() <= letters {
        return text.to_owned();
    }
    text.chars().take(letters.saturating_sub(3)).collect::<String>() + "..."
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_isotropic_lamp_draws_a_circle() {
        let web = Intensity::new(vec![0.0], vec![0.0, 180.0], vec![10.0; 2]);
        let circle = curve(&web, 0.0, [50.0, 60.0], 3.0, FINE);
        assert!(circle.iter().all(|[x, y]| ((x - 50.0).hypot(y - 60.0) - 30.0).abs() < 1e-9));
        let length = |line: &[[f64; 2]]| -> f64 {
            line.windows(2).map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1])).sum()
        };
        // Dashes and gaps take turns; the last dash may be cut short.
        let around = length(&circle) + length(&[circle[circle.len() - 1], circle[0]]);
        let dashes = dashes(&circle);
        assert_eq!(dashes.len(), (around / (DASH[0] + DASH[1])).ceil() as usize);
        assert!(dashes[..dashes.len() - 1].iter().all(|dash| (length(dash) - DASH[0]).abs() < 1e-9));
    }

    /// C0 is drawn to the right, the nadir below.
    #[test]
    fn light_is_drawn_where_it_goes() {
        let web = Intensity::new(vec![0.0, 180.0], vec![0.0, 60.0], vec![0.0, 10.0, 0.0, 0.0]);
        let curve = curve(&web, 0.0, [0.0, 0.0], 1.0, FINE);
        let (sin, cos) = 60_f64.to_radians().sin_cos();
        let outermost = curve.iter().max_by(|a, b| a[0].total_cmp(&b[0])).unwrap();
        assert!((outermost[0] - 10.0 * sin).abs() < 1e-3 && (outermost[1] - 10.0 * cos).abs() < 1e-3, "{outermost:?}");
    }
}
