//! Too few photons, and photons in one place.

use std::f64::consts::PI;
use std::path::Path as Folder;

use crate::error::Error;
use crate::flux::Flux;
use crate::gather::density::{SearchLimits, local_linear, paper};
use crate::gather::visible::VisiblePolygon;
use crate::photon_map::{BruteForce, KdTree, Kiddo, NearestPhotons, Paper, PhotonMap};
use crate::render::plan::Method::{Gather, Photons, Seed, Split};
use crate::study::check::cases::{CUBE, FLUX, cube};
use crate::study::check::forms::closed_room;
use crate::study::check::{Case, CaseResult, CaseVerdict, Measurand};

pub(super) const PHOTONS: &str = "photons";

pub(super) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (photons, k) in [(1, 10), (2, 10), (9, 10), (10, 10), (99, 100), (100, 100)] {
        for method in [Gather, Split, Photons, Seed] {
            let name = format!("{photons} photons, k = {k}, {}", method.name());
            let case =
                Case::new(PHOTONS, name, "k nearest of fewer than k", cube(0.5, 1.0, [0.0; 3], 8)).method(method);
            let exact = closed_room(FLUX, 0.5, CUBE);
            cases.push(
                // Nothing can be known of the light: only that what is found is a number, and that the run says so.
                case.photons(photons)
                    .nearest(k)
                    .expects(Measurand::Mean("floor"), exact, f64::INFINITY)
                    .warned("can't be trusted")
                    .closed()
                    .quick(),
            );
        }
    }
    cases.push(Case::own(PHOTONS, "k photons in one place", "a disc of no size", coincident::<KdTree>).quick());
    cases.push(Case::own(PHOTONS, "k photons in one place, kiddo", "a disc of no size", coincident::<Kiddo>).quick());
    cases.push(
        Case::own(PHOTONS, "k photons in one place, paper's tree", "a disc of no size", coincident::<Paper>).quick(),
    );
    cases.push(
        Case::own(PHOTONS, "k photons in one place, no tree", "a disc of no size", coincident::<BruteForce>).quick(),
    );
    cases
}

/// 200 photons at one point, asked for there with k = 100: no disc is smaller than the floor r = 1 mm of the search, so
/// the paper's estimate is k φ/(π r²) (all of them, where a tree counts those that lie as near as the k-th), and the
/// local-linear one, whose kernel has its peak there, at most twice the flux of all over that disc.
fn coincident<T: NearestPhotons>(_: &Folder) -> Result<CaseResult, Error> {
    let (count, k, floor, flux) = (200, 100, 1e-3_f32, 0.5_f32);
    let map: PhotonMap<T, 1> = PhotonMap::build(vec![[0.25, -0.5, 0.0]; count], vec![Flux([flux]); count]);
    let search = SearchLimits { nearest: k, radius: 0.5, floor };
    let mut scratch = map.scratch();
    let printed = paper(&map, [0.25, -0.5, 0.0], search, &mut scratch);
    let around = VisiblePolygon::open();
    let linear = local_linear(&map, [0.25, -0.5], search, &around, &mut scratch);
    let disc = PI * f64::from(floor).powi(2);
    let exact = k as f64 * f64::from(flux) / disc;
    let most = 2.0 * count as f64 * f64::from(flux) / disc;
    let values = [printed.value[0], printed.variance, linear.value[0], linear.variance];
    let fault = if values.iter().any(|value| !value.is_finite()) {
        Some(format!("found {values:?}, expected finite numbers"))
    } else if (printed.value[0] / exact - 1.0).abs() > 1e-5 {
        Some(format!("the paper's estimate is {}, expected {exact}", printed.value[0]))
    } else if !(0.0..=most * (1.0 + 1e-5)).contains(&linear.value[0]) {
        Some(format!("the local-linear estimate is {}, expected at most {most}", linear.value[0]))
    } else {
        None
    };
    Ok(CaseResult {
        group: PHOTONS,
        name: String::new(),
        why: "",
        method: "seed".into(),
        reading: "at the point, lx".into(),
        exact: Some(exact),
        found: Some(printed.value[0]),
        claimed: Some(printed.variance.sqrt()),
        allowed: Some(1e-5 * exact),
        balance: None,
        escapes: None,
        cut_off: None,
        seconds: 0.0,
        warnings: Vec::new(),
        verdict: fault.map_or(CaseVerdict::Inside, CaseVerdict::Outside),
    })
}
