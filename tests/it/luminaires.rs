//! Luminaires: the same light, however the scene file says it.

use std::f64::consts::PI;

use crate::common::assert_close;
use crate::common::mean;
use crate::common::room;
use crate::common::run;
use crate::common::scene;
use crate::common::sensor;
use crate::common::shipped;
use luxmap::render::plan::Method;

/// On the axis of a Lambertian disc, E = π L r²/(r² + h²). The disc is computed as a regular 96-gon of the same area,
/// whose corners stand 0.04 % of r outside: 10⁻⁶ of E at h = r.
#[test]
fn a_disc_on_its_axis_has_its_closed_form() {
    let heights = [0.3, 0.5, 1.0, 3.0];
    let sensors: String = heights.map(|h| sensor(&format!("{h} m"), [0.0, 0.0, -h], [0.0, 0.0, 1.0])).concat();
    let toml = format!(
        "[[luminaire]]\nname = \"disc\"\nposition = [0, 0, 0]\nopening = {{ disc = 1.0 }}\nflux = 1000\n{sensors}"
    );
    let results = run(&scene("disc", &toml, ""), Method::Split, 1, 0);
    for (reading, h) in results.sensors.iter().zip(heights) {
        let luminance = 1000.0 / (PI * PI * 0.25);
        // The opening hangs 10⁻⁵ of half the scene's extent (1.5 m) lower than the file says.
        let expected = PI * luminance * 0.25 / (0.25 + (h - 1.5e-5_f64).powi(2));
        assert_close(&reading.name, reading.illuminance, expected, 1e-5);
    }
}

/// A panel is the same light as `[[luminaire]]` and as a mesh with Ke = Φ/(π A); the first hangs up to 2·10⁻⁵ m lower,
/// which the floor 2.5 m below sees as 2·10⁻⁵, and the same photons need not be drawn.
#[test]
fn a_panel_is_the_same_light_as_luminaire_and_as_mesh() {
    let plane =
        "[[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [4, 0, 0]\nacross = [0, 4, 0]\ncells = [20, 20]\n";
    let walls = room([0.0; 3], [4.0, 4.0, 3.0], ["wall"; 6]);
    let material = "[material.wall]\nreflectance = 0.5\n";
    let luminaire =
        "[[luminaire]]\nname = \"panel\"\nposition = [1.5, 2, 2.5]\nopening = { rectangle = [1, 0.5] }\nflux = 1000\n";
    let of_file = run(&scene("panel", &format!("{material}{luminaire}{plane}"), &walls), Method::Split, 200_000, 1);

    let luminance = 1000.0 / (PI * 0.5);
    let mtl = format!("newmtl lamp\nKd 0 0 0\nKe {luminance} {luminance} {luminance}\n");
    std::fs::write(crate::common::folder("panel_mesh").join("mesh.mtl"), mtl).expect("the target folder is writable");
    let quad = "usemtl lamp\nv 1 1.75 2.5\nv 1 2.25 2.5\nv 2 2.25 2.5\nv 2 1.75 2.5\nf 9 10 11 12\n";
    let obj = format!("mtllib mesh.mtl\n{walls}{quad}");
    let of_mesh = run(&scene("panel_mesh", &format!("{material}{plane}"), &obj), Method::Split, 200_000, 1);

    let direct = |results: &luxmap::results::Results| {
        let direct = results.maps[0].direct.clone().expect("split knows direct light");
        direct.iter().sum::<f64>() / direct.len() as f64
    };
    assert_close("direct", direct(&of_file), direct(&of_mesh), 1e-4);
    // Of 200,000 photons, about 0.3 each come back to the floor: 4 √2/√60000.
    assert_close("in all", mean(&of_file.maps[0]), mean(&of_mesh.maps[0]), 4.0 * (2.0_f64 / 60_000.0).sqrt());
}

/// Half the dimming is half the light everywhere, to the rounding of single precision: the photons are the same.
#[test]
fn light_is_proportional_to_flux() {
    let of = |dimming: f64| {
        let toml = format!(
            "[material.wall]\nreflectance = 0.7\n[[luminaire]]\nname = \"lamp\"\nposition = [1, 1, 2]\nflux = 800\ndimming = {dimming}\n\
             [[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [3, 0, 0]\nacross = [0, 3, 0]\ncells = [15, 15]\n"
        );
        let scene = scene(&format!("dimming_{dimming}"), &toml, &room([0.0; 3], [3.0; 3], ["wall"; 6]));
        run(&scene, Method::Split, 50_000, 2).maps.remove(0).illuminance
    };
    for (half, full) in of(0.5).iter().zip(of(1.0)) {
        assert!((2.0 * half / full - 1.0).abs() < 1e-6, "{half} lx at half, {full} lx at full output");
    }
}

/// Emitted = absorbed + escaped + cut off in every shipped scene: mirrors, glass and colours included. Sums are in double
/// precision, so 10⁵ terms leave 10⁻¹¹. However photons are shared among parts of a pass, the luminaires' flux is emitted.
#[test]
fn flux_balances_in_every_shipped_scene() {
    let scenes = ["seed-office.toml", "box.toml", "furnace.toml", "caustic.toml", "gallery.toml"];
    for (name, method) in scenes.into_iter().flat_map(|name| [(name, Method::Photons), (name, Method::Gather)]) {
        let scene = shipped(name);
        let flux = run(&scene, method, 100_000, 3).run.flux;
        let accounted = flux.absorbed + flux.escaped + flux.cut_off;
        assert_close(name, accounted.0, flux.emitted.0, 1e-9);
        let installed: f64 = scene.luminaires.iter().map(|luminaire| luminaire.flux.0).sum();
        assert_close(name, flux.emitted.0, installed, 1e-6); // a photon's share is single precision
        assert!(flux.escaped.0 <= 1e-6 * flux.emitted.0, "{name} is closed, but {} escaped", flux.escaped);
    }
}
