//! Control of a room over its influence matrix: the loop itself, ANA/RC against the optimum, scripts and their mistakes.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use luxmap::control::{AnaRc, Controller, Installation, Observation, Parameters, Phase, Script, Series};
use luxmap::control::{phases, simulate, simulate_with};
use luxmap::dimming::influence::{Dimmable, Place};
use luxmap::dimming::{Goal, Influence, solve};
use luxmap::luminaire::Supply;
use luxmap::photon::random::Stream;

/// Twelve lamps of 3000 lm, cos-shaped, 1.95 m above five desks: E = (Φ/π) h²/r⁴ of each, no walls. Power 0.5 W … 30 W.
fn room(targets: [Option<f64>; 5]) -> Influence {
    let (height, flux) = (1.95_f64, 3000.0);
    let lamps: Vec<[f64; 2]> = (0..12).map(|i| [1.0 + 1.8 * f64::from(i % 3), 0.8 + 1.6 * f64::from(i / 3)]).collect();
    let desks = [[1.4, 1.5], [4.2, 1.4], [1.5, 3.9], [4.4, 3.6], [2.9, 5.4]];
    let supply = Supply { power: Some(vec![[0.0, 0.5], [1.0, 30.0]]), off: 0.5, ..Supply::default() };
    let luminaires = (0..lamps.len()).map(|i| Dimmable {
        name: format!("L{}", i + 1),
        group: "L".into(),
        flux,
        candela: Some(flux / std::f64::consts::PI),
        supply: supply.clone(),
    });
    let sensors = desks.iter().zip(targets).enumerate().map(|(j, ([x, y], target))| Place {
        name: format!("desk {}", j + 1),
        position: [*x, *y, 0.75],
        normal: [0.0, 0.0, 1.0],
        target,
        tolerance: Some(50.0),
        daylight: 0.0,
    });
    let lux = |[x, y]: &[f64; 2]| -> Vec<f64> {
        let of = |lamp: &[f64; 2]| {
            let square = (x - lamp[0]).powi(2) + (y - lamp[1]).powi(2) + height * height;
            flux / std::f64::consts::PI * height * height / (square * square)
        };
        lamps.iter().map(of).collect()
    };
    Influence {
        scene: "lamps over desks".into(),
        scene_sha256: String::new(),
        luminaires: luminaires.collect(),
        sensors: sensors.collect(),
        lux: desks.iter().map(lux).collect(),
        standard_error: vec![vec![0.0; lamps.len()]; desks.len()],
    }
}

#[test]
#[ignore = "a study"]
fn tune() {
    let path = std::env::var("INFLUENCE").expect("INFLUENCE names a file");
    let influence = Influence::read(Path::new(&path)).expect("it is one");
    let text = fs::read_to_string(std::env::var("SCRIPT").expect("SCRIPT names a file")).expect("it is there");
    let script = Script::parse(Path::new("script"), &text, &influence).unwrap_or_else(|error| panic!("{error}"));
    let seeds = std::env::var("SEEDS").ok().and_then(|n| n.parse().ok()).unwrap_or(20);
    let all: Vec<Vec<Phase>> =
        (0..seeds).map(|seed| phases(&simulate(&influence, &script, seed).expect("it runs"), &script)).collect();
    for number in 0..all[0].len() {
        let each: Vec<&Phase> = all.iter().map(|phases| &phases[number]).collect();
        let excess: Vec<f64> = each.iter().map(|phase| 100.0 * phase.excess().unwrap_or(0.0)).collect();
        let most = |value: &dyn Fn(&Phase) -> f64| each.iter().map(|phase| value(phase)).fold(0.0, f64::max);
        println!(
            "{:40} optimum {:6.1}  mean {:+.1} %  worst {:+.1} %  below {:.0}  above {:.0}  mean miss {:.1}  settled {:.0}",
            each[0].what.join(", "),
            each[0].optimum,
            excess.iter().sum::<f64>() / excess.len() as f64,
            excess.iter().fold(-100.0, |a: f64, b| a.max(*b)),
            most(&|phase| phase.below),
            most(&|phase| phase.above),
            most(&|phase| phase.mean_miss),
            most(&|phase| phase.settled.unwrap_or(9999.0)),
        );
    }
}
