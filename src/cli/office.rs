//! `luxmap office`: an open-plan office of any size, as a scene.

use std::path::PathBuf;
use std::time::Instant;

use clap::builder::PossibleValuesParser;

use super::{Outcome, named, print};
use crate::error::Error;
use crate::office::{Office, Parameters, Windows};
use crate::text::number;

/// Make up an open-plan office: a large, realistic scene (OBJ, MTL, TOML, .ies), the same bytes for the same options.
///
/// Triangles of a workstation: about 2200 at detail 1, 13 000 at 2, 94 000 at 5, 560 000 at 16; exact numbers are
/// printed.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Folder for the scene: office.toml and what it names.
    #[arg(long, short, value_name = "DIR", default_value = "out/office")]
    output: PathBuf,
    /// Desks with what belongs to them; the floor grows with them.
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = whole(Parameters::WORKSTATIONS))]
    workstations: u32,
    /// How finely curves and faces are cut, from 1 to 32; triangles grow faster than it [default: 2].
    #[arg(long, value_name = "D", value_parser = whole(Parameters::DETAIL), conflicts_with = "triangles")]
    detail: Option<u32>,
    /// Choose the detail that comes nearest to so many triangles.
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u64).range(1..))]
    triangles: Option<u64>,
    /// Of what stands on the desks, and of chairs pushed about.
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Clear height of the room, m, from 2.4 to 6.
    #[arg(long, value_name = "M", default_value_t = 2.8, allow_negative_numbers = true)]
    height: f64,
    /// Windows at night: glass (dark, mirrors 8 %), matte (no mirror, so no caustics) or none.
    #[arg(long, value_name = "KIND", default_value = "glass", hide_possible_values = true,
          value_parser = PossibleValuesParser::new(Windows::ALL.map(|(name, _)| name)))]
    windows: String,
    /// About how many panel luminaires, 1 to 20 for six desks; downlights over the aisles come on top [default: one
    /// each].
    #[arg(long, value_name = "N", value_parser = whole(1..=1_000_000))]
    luminaires: Option<u32>,
    /// Mean illuminance the luminaires' flux is chosen for, lx; sensors ask for 55 % of it, which every desk can have.
    #[arg(long, value_name = "LX", default_value_t = 500.0, allow_negative_numbers = true)]
    illuminance: f64,
    /// Grid step of the measuring planes, m.
    #[arg(long, value_name = "M", default_value_t = 0.1, allow_negative_numbers = true)]
    cell: f64,
}

fn whole(allowed: std::ops::RangeInclusive<u32>) -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(i64::from(*allowed.start())..=i64::from(*allowed.end()))
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let started = Instant::now();
    let defaults = Parameters::default();
    let parameters = Parameters {
        workstations: arguments.workstations,
        detail: arguments.detail.unwrap_or(defaults.detail),
        seed: arguments.seed,
        height: arguments.height,
        windows: named(&arguments.windows, Windows::ALL).unwrap_or_default(),
        luminaires: arguments.luminaires,
        illuminance: arguments.illuminance,
        cell: arguments.cell,
    };
    let parameters = match arguments.triangles {
        Some(triangles) => parameters.with_triangles(triangles)?,
        None => parameters,
    };
    let office = Office::new(parameters)?;
    let written = office.write(&arguments.output)?;
    print(&format!(
        "{}: {} workstations at detail {}, {:.1} × {:.1} × {:.1} m, {:.1} m²\n\
         {} triangles, {} luminaires with {} lm; {:.1} MB in {}\n",
        arguments.output.join("office.toml").display(),
        office.parameters.workstations,
        office.parameters.detail,
        office.size.x,
        office.size.y,
        office.size.z,
        office.area(),
        number::count(written.triangles),
        number::count(u64::from(written.luminaires)),
        number::count(written.flux as u64),
        written.bytes as f64 / 1e6,
        number::duration(started.elapsed().as_secs_f64()),
    ))?;
    Ok(Outcome::Done)
}
