//! A room reads the same whatever lies about it: ground of any size, and a forgotten triangle at the other end of the country.
//!
//! The rooms are closed, so nothing outside adds light; openings move by less than 10⁻⁵ of the room off what they are flush with.
//! Photons and rays draw the same numbers with and without surroundings, so means differ by far less than their noise.

use std::fs;
use std::path::Path;

use crate::common;
use crate::common::assert_close;
use crate::common::mean;
use crate::common::room;
use crate::common::run_with;
use crate::common::scene;
use crate::common::sensor;
use luxmap::render::Settings;
use luxmap::render::Stop;
use luxmap::render::plan::Method;
use luxmap::results::IlluminanceMap;
use luxmap::results::Results;
use luxmap::scene::Scene;
use luxmap::study::check::scenes::polygon;

/// A square of ground, bright.
fn below(half: f64, z: f64) -> String {
    polygon("ground", &[[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
}

/// Ground at the height of the floor that begins 1 m beside the room.
fn beside(wall: f64, half: f64) -> String {
    polygon("ground", &[[wall + 1.0, -half, 0.0], [half, -half, 0.0], [half, half, 0.0], [wall + 1.0, half, 0.0]])
}

/// A triangle of 10 cm, 200 km away.
fn speck() -> String {
    polygon("ground", &[[2e5, 100.0, 50.0], [2e5, 100.1, 50.0], [2e5, 100.0, 50.1]])
}

/// What may lie about a room whose outer wall is at x = `wall`.
fn surroundings(wall: f64) -> Vec<(&'static str, String)> {
    vec![
        ("20 m below", below(10.0, -1.0)),
        ("2 km below", below(1e3, -1.0)),
        ("200 km below", below(1e5, -0.1)),
        ("20 m beside", beside(wall, 20.0)),
        ("200 km beside", beside(wall, 1e5)),
        ("a speck", speck()),
        ("all", below(1e5, -1.0) + &beside(wall, 2e5) + &speck()),
    ]
}

const GROUND: &str = "[material.ground]\nreflectance = 0.9\n";
const SIZE: [f64; 3] = [4.0, 4.0, 3.0];

/// A room of 4 × 4 × 3 m with a panel in it at height `panel`, and what lies about it.
fn box_room(test: &str, walls: f64, panel: f64, around: &str) -> Scene {
    let mut toml = format!("[material.wall]\nreflectance = {walls}\n");
    if around.contains("ground") {
        toml += GROUND;
    }
    toml += &format!(
        "[[luminaire]]\nname = \"L\"\nposition = [2.0, 2.0, {panel}]\nopening = {{ rectangle = [0.4, 0.4] }}\nflux = 3000\n\
         [[plane]]\nname = \"floor\"\ncorner = [0,0,0]\nalong = [4,0,0]\nacross = [0,4,0]\ncells = [16,16]\n\
         [[plane]]\nname = \"high\"\ncorner = [0,0,1]\nalong = [4,0,0]\nacross = [0,4,0]\ncells = [16,16]\non = \"air\"\n"
    );
    // At the foot of a wall, where starts of rays lie in it.
    toml += &sensor("foot", [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]);
    scene(test, &toml, &(room([0.0; 3], SIZE, ["wall"; 6]) + around))
}

/// √(mean σ²) over the mean.
fn claim(map: &IlluminanceMap) -> f64 {
    common::claim(map) / mean(map)
}

/// Means agree within 0.3 %, and within three times the noise that all cells share, which is a third of what is claimed for a
/// cell at most; each cell agrees within four times the noise of both.
fn assert_same(what: &str, found: &Results, alone: &Results) {
    for (found, alone) in found.maps.iter().zip(&alone.maps) {
        let what = format!("{what}, {}", found.name);
        assert_close(&what, mean(found), mean(alone), claim(found).hypot(claim(alone)).min(3e-3));
        for cell in 0..found.illuminance.len() {
            assert_eq!(found.has_value[cell], alone.has_value[cell], "{what}: cell {cell}");
            let off = (found.illuminance[cell] - alone.illuminance[cell]).abs();
            let sigma = found.standard_error[cell].hypot(alone.standard_error[cell]);
            assert!(off <= 4.0 * sigma + 1e-4 * mean(alone), "{what}: cell {cell} is off by {off} lx, σ {sigma} lx");
        }
    }
    assert_eq!(found.run.warnings, alone.run.warnings, "{what}");
}

#[test]
fn the_seed_office_reads_the_same_whatever_lies_about_it() {
    let folder = crate::common::folder("scale_office");
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for file in ["seed-office.obj", "seed-office.mtl"] {
        fs::copy(shipped.join(file), folder.join(file)).expect("the target folder is writable");
    }
    let toml = fs::read_to_string(shipped.join("seed-office.toml")).expect("it is shipped");
    let office = |around: &str| {
        let more =
            if around.is_empty() { String::new() } else { format!("\n[[mesh]]\nfile = \"around.obj\"\n{GROUND}") };
        fs::write(folder.join("around.obj"), around).expect("the target folder is writable");
        fs::write(folder.join("office.toml"), format!("{toml}{more}")).expect("the target folder is writable");
        let scene = Scene::load(&folder.join("office.toml")).unwrap_or_else(|error| panic!("{error}"));
        run_with(
            &scene,
            Method::Gather,
            &Settings { photons: 50_000, stop: Stop::after(1), ..Settings::of(Method::Gather) },
        )
    };
    let alone = office("");
    for (what, around) in surroundings(7.0) {
        if ["20 m below", "200 km below", "all"].contains(&what) {
            assert_same(what, &office(&around), &alone);
        }
    }
}

#[test]
fn every_method_reads_a_room_the_same_whatever_lies_about_it() {
    for (method, photons, passes) in
        [(Method::Gather, 50_000, 2), (Method::Split, 200_000, 1), (Method::Path, 1, 8), (Method::Photons, 200_000, 1)]
    {
        let settings = Settings { photons, stop: Stop::after(passes), smooth: true, ..Settings::of(method) };
        let read = |around: &str| run_with(&box_room("scale_box", 0.5, 2.5, around), method, &settings);
        let alone = read("");
        for (what, around) in
            surroundings(SIZE[0]).into_iter().filter(|(what, _)| ["2 km below", "a speck", "all"].contains(what))
        {
            assert_same(&format!("{}, {what}", method.name()), &read(&around), &alone);
        }
    }
}

/// Where nothing bounces, light is exact but for how far the opening moved: δ ≤ 4·10⁻⁵ m of 2 m to the nearest point that is
/// measured, 2 δ/h = 4·10⁻⁵; and for single precision in the points' places. The panel is flush with the ceiling, and may be
/// with a roof of 20 km as well.
#[test]
fn direct_light_is_the_same_whatever_lies_about_the_room() {
    let read = |around: &str| {
        run_with(&box_room("scale_black", 0.0, 3.0, around), Method::Gather, &Settings::of(Method::Gather))
    };
    let alone = read("");
    let roof = ("a roof of 20 km", below(1e4, 3.0));
    let tilted = polygon("ground", &[[-1e5, -1e5, -2e4], [1e5, -1e5, -2e4], [1e5, 1e5, 1e4], [-1e5, 1e5, 1e4]]);
    let more = [roof, ("a slope that is the room's neighbour", tilted)];
    for (what, around) in surroundings(SIZE[0]).into_iter().chain(more) {
        let found = read(&around);
        for (found, alone) in found.maps.iter().zip(&alone.maps) {
            for (cell, (found, alone)) in found.illuminance.iter().zip(&alone.illuminance).enumerate() {
                assert!((found / alone - 1.0).abs() < 1e-4, "{what}: cell {cell}: {found} lx, alone {alone} lx");
            }
        }
        let [found, alone] = [&found, &alone].map(|results| results.sensors[0].illuminance);
        assert_close(what, found, alone, 1e-4);
    }
}

/// A room whose floor and ceiling are parts of a ground and a roof of 20 km is that room. (All it is made of lies in four walls
/// and two squares of 20 km: a luminaire flush with the one, points on the other.)
#[test]
fn a_floor_and_a_ceiling_of_20_km_make_a_room() {
    let read = |walls: f64, obj: &str, method: Method| {
        let toml = format!(
            "[material.wall]\nreflectance = {walls}\n\
             [[luminaire]]\nname = \"L\"\nposition = [2.0, 2.0, 3.0]\nopening = {{ rectangle = [0.4, 0.4] }}\nflux = 3000\n\
             [[plane]]\nname = \"floor\"\ncorner = [0,0,0]\nalong = [4,0,0]\nacross = [0,4,0]\ncells = [16,16]\n"
        );
        let settings = Settings { photons: 200_000, stop: Stop::after(2), smooth: true, ..Settings::of(method) };
        run_with(&scene("scale_slabs", &toml, obj), method, &settings)
    };
    let square = |half: f64, z: f64| below(half, z).replace("ground", "wall");
    let walls: String = [[0.0, 0.0, 4.0, 0.0], [4.0, 0.0, 4.0, 4.0], [4.0, 4.0, 0.0, 4.0], [0.0, 4.0, 0.0, 0.0]]
        .map(|[a, b, c, d]| polygon("wall", &[[a, b, 0.0], [a, b, 3.0], [c, d, 3.0], [c, d, 0.0]]))
        .concat();
    let large = walls + &square(1e4, 0.0) + &square(1e4, 3.0);
    let small = room([0.0; 3], SIZE, ["wall"; 6]);
    for method in [Method::Gather, Method::Split, Method::Path] {
        let [found, alone] = [&large, &small].map(|obj| read(0.5, obj, method));
        assert_same(method.name(), &found, &alone);
    }
    let [found, alone] = [&large, &small].map(|obj| mean(&read(0.0, obj, Method::Gather).maps[0]));
    assert_close("black", found, alone, 1e-4);
}

/// A closed room of ρ 0.2, 0.7 and 0.5 above a ground of 20 km: 112 lx on its floor, as without the ground; the ground moved the
/// opening by 0.1 m once, and made that 115.4 lx.
#[test]
fn a_ground_of_20_km_adds_nothing_to_a_closed_room() {
    let read = |around: &str| {
        let materials = "[material.floor]\nreflectance = 0.2\n[material.ceiling]\nreflectance = 0.7\n[material.wall]\nreflectance = 0.5\n";
        let toml = "[[luminaire]]\nname = \"L\"\nposition = [2.0, 2.0, 2.5]\nopening = { rectangle = [0.4, 0.4] }\nflux = 3000\n\
                    [[plane]]\nname = \"floor\"\ncorner = [0,0,0]\nalong = [4,0,0]\nacross = [0,4,0]\ncells = [16,16]\n";
        let obj = room([0.0; 3], SIZE, ["floor", "ceiling", "wall", "wall", "wall", "wall"]) + around;
        let settings = Settings { stop: Stop::after(4), ..Settings::of(Method::Gather) };
        run_with(&scene("scale_ground", &format!("{materials}{toml}"), &obj), Method::Gather, &settings)
    };
    let [found, alone] = [read(&below(1e4, -1.0).replace("ground", "floor")), read("")];
    assert_close("mean", mean(&found.maps[0]), 112.0, 1.0 / 112.0);
    assert_same("20 km", &found, &alone);
}

/// A pavilion without its wall at x = 4 on bright ground: of the light that leaves it, what comes back from more than 40 m away
/// is less than (3/40)⁴ of it. So 200 km of ground are as good as 80 m; patches on them stay fine where it matters, and few.
#[test]
fn ground_that_is_seen_may_be_of_any_size() {
    let read = |half: f64, method: Method| {
        let hole = room([0.0; 3], SIZE, ["wall"; 6]);
        let faces: Vec<&str> = hole.split_inclusive("usemtl").collect();
        // Corners; then floor, ceiling, x low, x high, y low, y high: the fifth piece is that of x high.
        let open: String = faces.iter().enumerate().filter(|(face, _)| *face != 4).map(|(_, text)| *text).collect();
        let toml = format!(
            "[material.wall]\nreflectance = 0.5\n{GROUND}\
             [[luminaire]]\nname = \"L\"\nposition = [2.0, 2.0, 2.5]\nopening = {{ rectangle = [0.4, 0.4] }}\nflux = 3000\n\
             [[plane]]\nname = \"floor\"\ncorner = [0,0,0.1]\nalong = [4,0,0]\nacross = [0,4,0]\ncells = [16,16]\non = \"air\"\n"
        );
        let scene = scene("scale_pavilion", &toml, &(open + &below(half, -0.01)));
        assert!(scene.mesh.triangles.len() < 1000, "{} triangles", scene.mesh.triangles.len());
        let settings = Settings { photons: 200_000, stop: Stop::after(4), smooth: true, ..Settings::of(method) };
        run_with(&scene, method, &settings)
    };
    for method in [Method::Gather, Method::Path] {
        let [small, large] = [40.0, 1e5].map(|half| read(half, method));
        let (small, large) = (&small.maps[0], &large.maps[0]);
        let bound = claim(small).hypot(claim(large)).min(1e-2);
        assert_close(method.name(), mean(large), mean(small), bound);
    }
}

/// What lies far off has no part in the scene's size, be it a vertex that no face uses; and a luminaire that does is told.
#[test]
fn what_is_far_is_no_part_of_the_scenes_size() {
    let alone = box_room("scale_size", 0.5, 2.5, "");
    assert_eq!((alone.diagonal(), alone.half_extent()), (41.0_f64.sqrt(), 2.0));
    for around in [speck(), "v 500000 5500000 0\n".to_owned(), below(1e5, -1.0)] {
        let scene = box_room("scale_size", 0.5, 2.5, &around);
        assert!(scene.centre.distance([2.0, 2.0, 1.25].into()) < 2.0, "{}", scene.centre);
        assert!(scene.diagonal() < 40.0 && scene.half_extent() < 20.0, "{} m", scene.diagonal());
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
    let toml = "[[luminaire]]\nname = \"moon\"\nposition = [1e6, 0, 1e6]\nopening = { disc = 1.0 }\nflux = 1\n\
                [[luminaire]]\nname = \"L\"\nposition = [2, 2, 2.5]\nopening = { disc = 0.1 }\nflux = 1\n\
                [[plane]]\nname = \"floor\"\ncorner = [0,0,0]\nalong = [4,0,0]\nacross = [0,4,0]\ncells = [4,4]\n\
                [material.wall]\nreflectance = 0.0\n";
    let scene = scene("scale_moon", toml, &room([0.0; 3], SIZE, ["wall"; 6]));
    let results = run_with(&scene, Method::Gather, &Settings::of(Method::Gather));
    let told =
        results.run.warnings.iter().any(|warning| warning.contains("\"moon\" hangs 1.414e6 m from what is measured"));
    assert!(told, "{:?}", results.run.warnings);
}

/// A lamp 1 cm over a floor and 3.2 m away: cosine and distance are those of the point itself, however far off a large floor rays
/// have to start (0.1 mm on 200 m: 1 % of the lamp's height). E = I h/d³.
#[test]
fn a_low_lamp_over_a_large_floor_is_exact() {
    for half in [10.0, 100.0, 1000.0] {
        let toml = format!(
            "[material.ground]\nreflectance = 0.3\n[[luminaire]]\nname = \"lamp\"\nposition = [3.2, 0, 0.01]\nflux = 1000\n{}",
            sensor("meter", [0.0; 3], [0.0, 0.0, 1.0])
        );
        let scene = scene(&format!("scale_low_lamp_{half}"), &toml, &below(half, 0.0));
        let settings = Settings { photons: 1000, ..Settings::of(Method::Gather) };
        let found = run_with(&scene, Method::Gather, &settings).sensors[0].illuminance;
        let distance = 3.2_f64.hypot(0.01);
        let exact = 1000.0 / (4.0 * std::f64::consts::PI) * 0.01 / distance.powi(3);
        assert_close(&format!("floor of {} m", 2.0 * half), found, exact, 1e-4);
    }
}
