//! Cameras: where they stand, which way they look, and which ray belongs to which place of the image.

use glam::DVec3;

/// A pinhole camera with square pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Its name and that of its files.
    pub name: String,
    /// Where it stands, local, m.
    pub eye: DVec3,
    /// Unit vector along the view axis, through the middle of the image.
    pub forward: DVec3,
    /// Unit vector to the right of the image.
    pub right: DVec3,
    /// Unit vector to the top of the image.
    pub up: DVec3,
    /// Angle between the lowest and the highest ray in the image's middle column, degrees.
    pub fov: f64,
    /// Columns and rows of the image.
    pub pixels: [usize; 2],
}

impl Camera {
    /// The right and upper side of an image looking along the unit vector `forward` with the unit vector `up` as near
    /// to its upper side as can be; `None` where both are parallel.
    pub(super) fn sides(forward: DVec3, up: DVec3) -> Option<[DVec3; 2]> {
        let across = forward.cross(up);
        let right = (across.length() > 1e-6).then(|| across.normalize())?;
        Some([right, right.cross(forward)])
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.pixels[0] * self.pixels[1]
    }

    /// Whether there is no pixel; a validated camera always has some.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Side of a pixel in the image plane at distance 1.
    fn pixel_side(&self) -> f64 {
        2.0 * (self.fov / 2.0).to_radians().tan() / self.pixels[1] as f64
    }

    /// Width of the image plane at distance 1: what OpenEXR calls the screen window's width.
    pub fn screen_width(&self) -> f64 {
        self.pixel_side() * self.pixels[0] as f64
    }

    /// Unit vector of the ray through a place of the image, in pixels from its top left corner: pixel (i, j) has its
    /// middle at (i + ½, j + ½).
    pub fn direction(&self, [x, y]: [f64; 2]) -> DVec3 {
        let [columns, rows] = self.pixels.map(|side| side as f64);
        let (along, above) = (x - columns / 2.0, rows / 2.0 - y);
        (self.forward + (self.right * along + self.up * above) * self.pixel_side()).normalize()
    }

    /// The place of the image where a point (local, m) is seen; `None` for a point that isn't in front of the camera.
    pub fn place(&self, point: DVec3) -> Option<[f64; 2]> {
        let to = point - self.eye;
        let depth = to.dot(self.forward);
        let [columns, rows] = self.pixels.map(|side| side as f64);
        let per_pixel = 1.0 / (depth * self.pixel_side());
        (depth > 0.0)
            .then(|| [columns / 2.0 + to.dot(self.right) * per_pixel, rows / 2.0 - to.dot(self.up) * per_pixel])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(forward: DVec3, up: DVec3, fov: f64, pixels: [usize; 2]) -> Camera {
        let [right, up] = Camera::sides(forward, up).expect("not parallel");
        Camera { name: "view".into(), eye: DVec3::new(1.0, 2.0, 1.5), forward, right, up, fov, pixels }
    }

    /// Half the field of view above the axis lies the image's upper edge; pixels are as wide as high, so the left edge
    /// is at atan(tan(fov/2) · columns/rows).
    #[test]
    fn edges_of_the_image_are_where_the_field_of_view_ends() {
        let camera = camera(DVec3::Y, DVec3::Z, 70.0, [960, 540]);
        let angle = |place| camera.direction(place).angle_between(DVec3::Y).to_degrees();
        assert!((angle([480.0, 0.0]) - 35.0).abs() < 1e-9, "{}", angle([480.0, 0.0]));
        let expected = (35_f64.to_radians().tan() * 960.0 / 540.0).atan().to_degrees();
        assert!((angle([0.0, 270.0]) - expected).abs() < 1e-9, "{}", angle([0.0, 270.0]));
        assert_eq!(camera.direction([480.0, 270.0]), DVec3::Y);
        assert!(camera.direction([960.0, 270.0]).x > 0.0, "looking north, east is to the right");
        assert!(camera.direction([480.0, 0.0]).z > 0.0, "the first row is on top");
    }

    /// A place's ray meets points that are seen at that place.
    #[test]
    fn places_and_rays_are_each_others_inverse() {
        let camera =
            camera(DVec3::new(3.0, -2.0, 1.0).normalize(), DVec3::new(0.1, 0.2, 1.0).normalize(), 50.0, [64, 48]);
        for place in [[0.0, 0.0], [12.5, 30.25], [64.0, 48.0], [63.5, 0.5]] {
            let found = camera.place(camera.eye + camera.direction(place) * 7.0).expect("in front");
            assert!((found[0] - place[0]).abs() + (found[1] - place[1]).abs() < 1e-9, "{found:?} for {place:?}");
        }
        assert_eq!(camera.place(camera.eye - camera.forward), None);
    }
}
