//! Cameras: what they see is where it is, as bright as it is, also in mirrors and behind glass.

use std::f64::consts::PI;
use std::path::Path;

use crate::common::assert_close;
use crate::common::passes;
use crate::common::room;
use crate::common::run_with;
use crate::common::scene;
use luxmap::render::Settings;
use luxmap::render::Stop;
use luxmap::render::plan::Method;
use luxmap::render::plan::Plan;
use luxmap::results::CameraImage;
use luxmap::results::IlluminanceMap;
use luxmap::scene::{Dimming, Scene};

fn camera(eye: [f64; 3], look_at: [f64; 3], fov: f64, pixels: [usize; 2]) -> String {
    format!("[[camera]]\nname = \"view\"\neye = {eye:?}\nlook_at = {look_at:?}\nfov = {fov:?}\npixels = {pixels:?}\n")
}

/// A shipped scene with a camera added.
fn shipped_with(test: &str, name: &str, camera: &str) -> Scene {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let text = std::fs::read_to_string(scenes.join(name)).expect("the scene is in the repository");
    let file = format!("file = \"{}/", scenes.display());
    let own = crate::common::folder(test).join("scene.toml");
    std::fs::write(&own, text.replace("file = \"", &file) + camera).expect("the target folder is writable");
    Scene::load_with(&own, &[scenes], &Dimming::AsWritten).unwrap_or_else(|error| panic!("{error}"))
}

/// A glowing closed room: every surface reflects half and sends out π · 100 lm/m²; walls of material `wall` instead.
fn glowing(test: &str, materials: [&str; 6], more: &str) -> Scene {
    let mtl = "newmtl glow\nKd 0.5 0.5 0.5\nKe 100 100 100\nnewmtl mirror\nKd 0 0 0\nKs 1 1 1\nillum 3\n";
    std::fs::write(crate::common::folder(test).join("glow.mtl"), mtl).expect("the target folder is writable");
    scene(test, more, &format!("mtllib glow.mtl\n{}", room([0.0; 3], [3.0, 2.0, 2.5], materials)))
}

/// Mean of a layer's photometric value over the pixels that `pick` takes.
fn mean(image: &CameraImage, value: impl Fn(usize) -> f64, pick: impl Fn(usize) -> bool) -> f64 {
    let values: Vec<f64> = (0..image.len()).filter(|&pixel| pick(pixel)).map(value).collect();
    assert!(!values.is_empty(), "no pixel of {} is picked", image.name);
    values.iter().sum::<f64>() / values.len() as f64
}

fn position(image: &CameraImage, pixel: usize) -> [f64; 3] {
    let origin = image.position_origin.to_array();
    std::array::from_fn(|axis| f64::from(image.position.0[axis][pixel]) + origin[axis])
}

/// A room of uniform ρ that glows all over has the same luminance everywhere, L = L₀/(1 − ρ), and E = π L; so does what a
/// perfect mirror in it shows, at any angle. Here ρ = 0.5 and L₀ = 100 cd/m².
#[test]
fn a_glowing_room_looks_the_same_everywhere_and_in_its_mirror() {
    let more = camera([0.4, 0.5, 1.0], [3.0, 1.4, 1.2], 80.0, [48, 36]);
    let materials = ["glow", "glow", "glow", "mirror", "glow", "glow"];
    let scene = glowing("camera_glow", materials, &more);
    for (method, photons) in [(Method::Gather, 200_000), (Method::Path, 0)] {
        let settings = Settings { stop: Stop::after(4), photons: photons.max(1), seed: 3, ..Settings::of(method) };
        let results = run_with(&scene, method, &settings);
        let image = &results.images[0];
        let in_mirror = |pixel: usize| (position(image, pixel)[0] - 3.0).abs() < 1e-4;
        let sigma = image.claim / (image.len() as f64).sqrt();
        // Pixels share photons: their mean is known to a part of the claim of one only.
        for (what, mirrored) in [("luminance in the mirror", true), ("luminance beside it", false)] {
            let found = mean(image, |pixel| image.luminance.photometric(pixel), |pixel| in_mirror(pixel) == mirrored);
            assert_close(&format!("{}, {what}", method.name()), found, 200.0, 4.0 * sigma + 0.05 * image.claim);
        }
        let found = mean(image, |pixel| image.illuminance.photometric(pixel), |_| true);
        assert_close(&format!("{}, E", method.name()), found, 200.0 * PI, 4.0 * sigma + 0.05 * image.claim);
        // Each pixel: RMS error against the claim, of 16 batches; a mirror itself reflects no E, its E is that of others.
        let square = mean(image, |pixel| (image.illuminance.photometric(pixel) / (200.0 * PI) - 1.0).powi(2), |_| true);
        let ratio = square.sqrt() / image.claim;
        println!("{}: claim {:.2} %, true RMS {ratio:.3} of it", method.name(), 100.0 * image.claim);
        assert!((0.85..1.15).contains(&ratio), "true error {ratio} of the claim");
    }
}

/// A wall straight ahead: depth along the axis is the same in every pixel, positions are where rays through the pixels'
/// middles meet it, normals face the eye. On survey coordinates too, to a millimetre.
#[test]
fn depth_normal_and_position_of_a_wall_are_exact() {
    for (test, at) in [("camera_wall", [0.0, 0.0, 0.0]), ("camera_far_wall", [2_600_123.25, 1_200_456.5, 408.0])] {
        let [low, high] =
            [[0.0; 3], [4.0, 3.0, 2.5]].map(|corner: [f64; 3]| [0, 1, 2].map(|axis| corner[axis] + at[axis]));
        let place = |p: [f64; 3]| [0, 1, 2].map(|axis| p[axis] + at[axis]);
        let more = camera(place([1.0, 1.5, 1.2]), place([4.0, 1.5, 1.2]), 40.0, [64, 48])
            + &format!("[[luminaire]]\nname = \"L\"\nposition = {:?}\nflux = 1000\n", place([2.0, 1.5, 2.0]))
            + "[material.wall]\nreflectance = 0.5\n";
        let scene = scene(test, &more, &room(low, high, ["wall"; 6]));
        let results = passes(&scene, Method::Gather, 1, 1);
        let image = &results.images[0];
        let half = 20_f64.to_radians().tan();
        for pixel in 0..image.len() {
            let (column, row) = (pixel % 64, pixel / 64);
            // The wall is 3 m away; a pixel is 2 · 3 m · tan 20° / 48 high, x of the image runs to −y.
            let side = 2.0 * 3.0 * half / 48.0;
            let expected =
                place([4.0, 1.5 - (column as f64 + 0.5 - 32.0) * side, 1.2 + (24.0 - row as f64 - 0.5) * side]);
            let found = position(image, pixel);
            let off = [0, 1, 2].map(|axis| (found[axis] - expected[axis]).abs()).into_iter().fold(0.0, f64::max);
            assert!(off < 1e-3 && (test != "camera_wall" || off < 2e-6), "{test}, pixel {column}, {row}: off {off} m");
            assert!((image.depth[pixel] - 3.0).abs() < 1e-5, "depth {}", image.depth[pixel]);
            let normal = [0, 1, 2].map(|axis| image.normal.0[axis][pixel]);
            assert_eq!((normal, image.coverage[pixel]), ([-1.0, 0.0, 0.0], 1.0));
            assert!((image.albedo.photometric(pixel) - 0.5).abs() < 1e-6);
        }
    }
}

/// Fraction of the pixels whose E is within two claims of the cell that they see, and the ratio of the means.
fn against_plane(image: &CameraImage, map: &IlluminanceMap, seen: impl Fn(usize) -> bool) -> [f64; 2] {
    let (mut within, mut count, mut sums) = (0.0, 0.0, [0.0; 2]);
    for pixel in (0..image.len()).filter(|&pixel| seen(pixel)) {
        let offset = glam::DVec3::from(position(image, pixel)) - map.corner;
        let share = |side: glam::DVec3| offset.dot(side) / side.length_squared();
        let [column, row] = [share(map.along) * map.cells[0] as f64, share(map.across) * map.cells[1] as f64];
        if !(0.0..map.cells[0] as f64).contains(&column) || !(0.0..map.cells[1] as f64).contains(&row) {
            continue;
        }
        let cell = row as usize * map.cells[0] + column as usize;
        let Some(expected) = map.value(cell) else { continue };
        let found = image.illuminance.photometric(pixel);
        let claim = f64::from(image.standard_error[pixel]).hypot(map.standard_error[cell]);
        within += f64::from(u8::from((found - expected).abs() <= 2.0 * claim));
        count += 1.0;
        sums = [sums[0] + found, sums[1] + expected];
    }
    assert!(count > 500.0, "only {count} pixels see the plane");
    [within / count, sums[0] / sums[1]]
}

/// E in the image is E on the measuring plane that the pixel sees, whatever the method, in a coloured room with shadows.
/// Errors of pixels have 15 degrees of freedom: 93.6 % lie within 2 σ, and the sharp shadow edges that a pixel averages
/// otherwise than a cell take a few. Means agree within three of the common error of photons and rays, a third of a percent each.
#[test]
fn a_camera_reads_what_the_measuring_plane_reads() {
    let view = camera([1.0, 0.1, 1.6], [1.0, 1.0, 0.0], 75.0, [96, 72]);
    let scene = shipped_with("camera_box", "box.toml", &view);
    let reference = passes(&scene, Method::Gather, 4, 8);
    for method in [Method::Gather, Method::Split, Method::Path, Method::Photons] {
        let results = passes(&scene, method, 4, 5);
        let image = &results.images[0];
        let on_floor = |pixel: usize| position(image, pixel)[2] < 1e-4 && image.normal.0[2][pixel] > 0.9999;
        let [within, ratio] = against_plane(image, &reference.maps[0], on_floor);
        println!("{}: {within:.3} within 2 σ, ratio of means {ratio:.4}, claim {:.4}", method.name(), image.claim);
        assert!(within > 0.89, "{}: {within} within 2 σ", method.name());
        assert!((ratio - 1.0).abs() < 0.01, "{}: means differ by {ratio}", method.name());
        assert!(image.illuminance.0.len() == 3, "a coloured scene has three channels");
    }
}

/// Caustics are seen where they fall, and as bright: E of the floor under a glass sphere and before a mirror, by the
/// densities on the surface that a camera asks for and by those on the measuring plane, which know nothing of each other.
/// Blocks of 0.25 m, since both blur a focus in their own way, and three claims: beside the mirror few rays find its lamp.
#[test]
fn a_camera_sees_caustics_as_bright_as_the_plane_does() {
    let view = camera([1.5, 0.15, 2.1], [1.5, 1.5, 0.0], 75.0, [120, 90]);
    let scene = shipped_with("camera_caustic", "caustic.toml", &view);
    let results = passes(&scene, Method::Gather, 2, 4);
    let (image, map) = (&results.images[0], &results.maps[0]);
    let mut blocks = std::collections::BTreeMap::<[u32; 2], [f64; 4]>::new();
    for pixel in 0..image.len() {
        let [x, y, z] = position(image, pixel);
        let cell = [x, y].map(|along| (along / 0.02) as usize);
        if z < 1e-4 && image.normal.0[2][pixel] > 0.9999 && cell[0] < 150 && cell[1] < 150 {
            let block = blocks.entry([x, y].map(|along| (along / 0.25) as u32)).or_default();
            let expected = map.value(cell[1] * 150 + cell[0]).unwrap_or(0.0);
            let found = image.illuminance.photometric(pixel);
            let variance =
                f64::from(image.standard_error[pixel]).powi(2) + map.standard_error[cell[1] * 150 + cell[0]].powi(2);
            *block = [block[0] + found, block[1] + expected, block[2] + 1.0, block[3] + variance];
        }
    }
    let whole = blocks.values().fold([0.0; 2], |sum, block| [sum[0] + block[0], sum[1] + block[1]]);
    assert_close("E of the floor", whole[0], whole[1], 0.02);
    let brightest = blocks.values().map(|block| block[1] / block[2]).fold(0.0, f64::max);
    let seen = blocks.values().filter(|block| block[2] >= 30.0);
    for [found, expected, pixels, variance] in seen {
        let (found, expected, claim) = (found / pixels, expected / pixels, variance.sqrt() / pixels);
        println!("{found:8.1} {expected:8.1} {claim:8.1} {pixels}");
        let bound = 0.1 * expected + 0.02 * brightest + 3.0 * claim;
        assert!((found - expected).abs() < bound, "{found} lx, on the plane {expected} lx");
    }
}

/// The luminance of a Lambertian wall doesn't depend on whence it is seen: straight, or in a perfect mirror.
#[test]
fn a_mirror_shows_walls_as_bright_as_they_are() {
    let lamp =
        "[[luminaire]]\nname = \"L\"\nposition = [2, 1.5, 2.4]\nopening = { rectangle = [0.6, 0.6] }\nflux = 3000\n";
    let materials = "[material.wall]\nreflectance = 0.5\n[material.mirror]\nspecular = 1.0\n";
    let views = camera([1.0, 1.2, 1.2], [4.0, 1.2, 1.2], 60.0, [60, 60]).replace("view", "straight")
        + &camera([1.5, 1.5, 1.2], [0.0, 1.5, 1.2], 20.0, [60, 60]).replace("view", "mirrored");
    // The wall at x = 0 is the mirror.
    let mesh = room([0.0; 3], [4.0, 3.0, 2.5], ["wall", "wall", "mirror", "wall", "wall", "wall"]);
    let scene = scene("camera_mirror", &format!("{lamp}{materials}{views}"), &mesh);
    let results = passes(&scene, Method::Gather, 8, 6);
    let [straight, mirrored] = [&results.images[0], &results.images[1]];
    let cameras = &scene.cameras;
    let (mut sums, mut count) = ([0.0; 2], 0.0_f64);
    for pixel in 0..mirrored.len() {
        let place = [pixel % 60, pixel / 60].map(|index| index as f64 + 0.5);
        let ray = cameras[1].direction(place);
        // To the mirror at x = 0, and back to the wall at x = 4.
        let eye = mirrored.eye;
        let way = (eye.x + 4.0) / -ray.x;
        let met = glam::DVec3::new(4.0, eye.y + way * ray.y, eye.z + way * ray.z);
        if !(0.3..2.7).contains(&met.y) || !(0.3..2.2).contains(&met.z) {
            continue;
        }
        let Some([x, y]) = cameras[0].place(met - scene.centre) else { continue };
        if (0.0..60.0).contains(&x) && (0.0..60.0).contains(&y) {
            sums[0] += mirrored.luminance.photometric(pixel);
            sums[1] += straight.luminance.photometric(y as usize * 60 + x as usize);
            count += 1.0;
        }
    }
    assert!(count > 1000.0, "{count} pixels show the same wall");
    // Pixels of both images have the claim of E; the mean of so many has this much less, and both share their photons.
    let bound = 4.0 * straight.claim.hypot(mirrored.claim) / count.sqrt() + 0.002;
    assert_close("luminance in the mirror", sums[0], sums[1], bound);
}

/// A pane of glass before a bright wall in a black room: at normal incidence each face reflects R = ((n − 1)/(n + 1))², and
/// with all reflections in between (1 − R)/(1 + R) of the luminance passes: 12/13 for n = 1.5. N rays that pass or don't
/// scatter by √(T (1 − T)/N).
#[test]
fn a_pane_of_glass_dims_by_fresnels_formula() {
    let pane = room([1.0, 0.5, 0.5], [1.01, 2.5, 2.0], ["pane"; 6]);
    // Its normals have to point outwards: the room's, turned around. Its corners come after the room's eight.
    let pane: String = pane
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(face) => {
                let corners: Vec<String> = face
                    .split(' ')
                    .rev()
                    .map(|index| (index.parse::<u32>().expect("an index") + 8).to_string())
                    .collect();
                format!("f {}\n", corners.join(" "))
            }
            None => format!("{line}\n"),
        })
        .collect();
    let walls = room([0.0; 3], [4.0, 3.0, 2.5], ["black", "black", "black", "glow", "black", "black"]);
    let mtl = "newmtl glow\nKd 0 0 0\nKe 500 500 500\nnewmtl black\nKd 0 0 0\nnewmtl pane\nNi 1.5\nillum 7\n";
    std::fs::write(crate::common::folder("camera_pane").join("pane.mtl"), mtl).expect("the target folder is writable");
    let view = camera([0.5, 1.5, 1.2], [4.0, 1.5, 1.2], 2.0, [64, 64]);
    let scene = scene("camera_pane", &view, &format!("mtllib pane.mtl\n{walls}{pane}"));
    let results = passes(&scene, Method::Gather, 2, 2);
    let image = &results.images[0];
    let (t, rays) = (12.0 / 13.0, (image.samples as usize * image.len()) as f64);
    let found = mean(image, |pixel| image.luminance.photometric(pixel), |_| true);
    assert_close("luminance behind glass", found, 500.0 * t, 4.0 * ((1.0 - t) / (t * rays)).sqrt() + 1e-5);
    // The layers tell of the wall behind.
    assert!((0..image.len()).all(|pixel| (image.depth[pixel] - 3.5).abs() < 1e-4 && image.coverage[pixel] == 1.0));
}

/// A lamp seen straight has the luminance of its opening, M/π = Φ/(π A), from its front; from behind it is dark. Nothing
/// beside it: there the image is empty, and says so.
#[test]
fn a_luminaire_has_its_luminance_and_nothing_is_nothing() {
    let lamp = "[[luminaire]]\nname = \"L\"\nposition = [0, 0, 3]\nopening = { rectangle = [1, 1] }\nflux = 3141.592653589793\n";
    let views = camera([0.0, 0.0, 1.0], [0.0, 0.0, 3.0], 60.0, [40, 40])
        + &camera([0.0, 0.0, 5.0], [0.0, 0.0, 3.0], 60.0, [40, 40]).replace("view", "behind");
    let scene = scene("camera_lamp", &format!("{lamp}{views}"), "");
    let results = passes(&scene, Method::Gather, 1, 2);
    let [front, behind] = [&results.images[0], &results.images[1]];
    // 2 m away the opening takes (1/(4 tan 30°))² of the image.
    let share = (1.0 / (4.0 * 30_f64.to_radians().tan())).powi(2);
    let covered = |image: &CameraImage| image.coverage.iter().map(|&share| f64::from(share)).sum::<f64>() / 1600.0;
    // Edge pixels: 4 · 17 of them, each known to less than a quarter.
    assert_close("coverage", covered(front), share, 0.25 * (4.0 * 17.0_f64).sqrt() / (1600.0 * share));
    assert_close("luminance", front.luminance.0[0][20 * 40 + 20].into(), 1000.0, 1e-5);
    assert_eq!((behind.luminance.0[0][20 * 40 + 20], behind.coverage[20 * 40 + 20]), (0.0, 1.0));
    assert_eq!((front.depth[0], front.coverage[0], front.luminance.0[0][0]), (1e10, 0.0, 0.0));
    assert!((front.depth[20 * 40 + 20] - 2.0).abs() < 1e-4);
}

/// Every pixel draws from its own streams, so an image has the same bits for any number of threads.
#[test]
fn one_and_three_threads_give_the_same_image() {
    let view = camera([1.5, 0.15, 2.1], [1.5, 1.5, 0.0], 75.0, [60, 45]);
    let scene = shipped_with("camera_bits", "caustic.toml", &view);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        let settings = Settings { photons: 50_000, seed: 5, ..Settings::of(Method::Gather) };
        let results = pool.install(|| run_with(&scene, Method::Gather, &settings));
        let image = &results.images[0];
        let layers = [&image.illuminance, &image.luminance, &image.direct, &image.normal, &image.position];
        let mut values: Vec<f32> = layers.iter().flat_map(|layer| layer.0.concat()).collect();
        values.extend(&image.standard_error);
        values.iter().map(|value| value.to_bits()).collect::<Vec<_>>()
    };
    assert!(on(1) == on(3));
}

/// The error that a run of cameras only ends by is the images'; without a camera no camera ray is cast.
#[test]
fn an_image_ends_by_its_own_error_and_no_camera_costs_nothing() {
    let view = camera([0.2, 0.2, 1.5], [1.5, 1.8, 0.5], 70.0, [40, 30]);
    let mut scene = shipped_with("camera_error", "box.toml", &view);
    let planes = std::mem::take(&mut scene.planes);
    let plan = Plan::new(&scene, Method::Gather);
    let settings = Settings { stop: Stop::at_error(4.0), ..Settings::for_plan(&plan) };
    let results = run_with(&scene, Method::Gather, &settings);
    assert!(results.images[0].claim <= 0.04 && results.run.passes > 1, "{:?}", results.images[0].claim);
    scene.planes = planes;
    scene.cameras.clear();
    let results = passes(&scene, Method::Gather, 1, 1);
    assert!(results.images.is_empty());
    assert!(results.run.seconds.iter().all(|(stage, _)| *stage != "camera rays"));
}
