//! Cameras that a scene does not have.

use caustica::scene::description::{Camera, Description, Lens, Projection};
use clap::Args;
use glam::{DAffine3, DMat3, DVec3};

/// In place of the scene's cameras.
#[derive(Debug, Default, Args)]
pub(crate) struct View {
    /// Look from there instead of from a camera of the scene [default: where all is seen, if the scene has none]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point, conflicts_with = "camera")]
    pub(crate) look_from: Option<DVec3>,
    /// Look from there at this, in the middle of the picture [default: the middle of the scene]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point, conflicts_with = "camera")]
    pub(crate) look_at: Option<DVec3>,
    /// Height of the view of --look-from, and of scenes without cameras [default: 40]
    #[arg(long, value_name = "DEGREES", value_parser = angle, conflicts_with = "camera")]
    pub(crate) fov: Option<f64>,
    /// Radius of a thin lens, for depth of field: the focal length over twice the f-number [default: the camera's own]
    #[arg(long, value_name = "METRES", value_parser = length, requires = "focus")]
    pub(crate) lens_radius: Option<f64>,
    /// Distance of what is sharp, along the direction of view: the feature depth
    #[arg(long, value_name = "METRES", value_parser = length, requires = "lens_radius")]
    pub(crate) focus: Option<f64>,
}

impl View {
    /// The lens that is asked for.
    pub(crate) fn lens(&self) -> Option<Lens> {
        Some(Lens { radius: self.lens_radius?, focus: self.focus? })
    }

    /// An option that says how, where nothing says from where.
    pub(crate) fn without_place(&self) -> Option<&'static str> {
        let how = [("--look-at", self.look_at.is_some()), ("--fov", self.fov.is_some())];
        how.into_iter().find(|(_, given)| *given && self.look_from.is_none()).map(|(option, _)| option)
    }

    /// The camera that is asked for; else one that sees all, from above its front, in a picture of that width over height.
    pub(crate) fn camera(&self, scene: &Description, aspect: f64) -> Camera {
        let (low, high) = scene.bounds().unwrap_or((DVec3::NEG_ONE, DVec3::ONE));
        let target = self.look_at.unwrap_or((low + high) / 2.0);
        let yfov = self.fov.unwrap_or(40.0).to_radians();
        let around = |corner: DVec3| (corner - target).abs();
        let radius = around(low).max(around(high)).length().max(f64::MIN_POSITIVE);
        // All of it within the narrower angle; direction, angle and least distance are a matter of taste.
        let half = (yfov / 2.0).min((f64::tan(yfov / 2.0) * aspect).atan());
        let distance = radius / half.sin().min(0.9);
        let from = self.look_from.unwrap_or_else(|| target + DVec3::new(0.5, 0.4, 1.0).normalize() * distance);
        let back = (from - target).normalize_or(DVec3::Z);
        let right = DVec3::Y.cross(back).normalize_or(DVec3::X);
        let matrix3 = DMat3::from_cols(right, back.cross(right), back);
        Camera::new("view", DAffine3 { matrix3, translation: from }, Projection::Perspective { yfov })
    }
}

fn point(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<_> =
        text.split(',').filter_map(|x| x.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    match (numbers[..].try_into(), text.split(',').count()) {
        (Ok(point), 3) => Ok(DVec3::from_array(point)),
        _ => Err("expected three numbers, as in 0,1.5,-2".into()),
    }
}

fn length(text: &str) -> Result<f64, String> {
    let metres = text.parse().ok().filter(|x: &f64| *x > 0.0 && x.is_finite());
    metres.ok_or_else(|| "expected a positive number".into())
}

fn angle(text: &str) -> Result<f64, String> {
    let degrees = text.parse().ok().filter(|x: &f64| *x > 0.0 && *x < 180.0);
    degrees.ok_or_else(|| "expected an angle between 0 and 180 degrees".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustica::scene::description::{Geometry, Instance};

    fn ball(at: DVec3, radius: f64) -> Description {
        let (geometry, transform) = (Geometry::Sphere { radius }, DAffine3::from_translation(at));
        let instance = Instance { name: String::new(), geometry, material: 0, transform };
        Description { instances: vec![instance], ..Description::default() }
    }

    #[test]
    fn points_and_angles() {
        assert_eq!(point("0, -1.5,2e3"), Ok(DVec3::new(0.0, -1.5, 2e3)));
        for wrong in ["", "1,2", "1,2,3,4", "1,x,3", "1,,3", "1,inf,3"] {
            assert!(point(wrong).is_err(), "{wrong}");
        }
        assert!(angle("0").is_err() && angle("180").is_err() && angle("90") == Ok(90.0));
        assert!(length("0").is_err() && length("inf").is_err() && length("0.02") == Ok(0.02));
    }

    #[test]
    fn all_is_seen_from_where_nothing_is_said() {
        for (radius, aspect) in [(1e-3, 1.0), (1.0, 3.0), (1e5, 0.25)] {
            let center = DVec3::new(7.0, -3.0, 2.0) * radius;
            let camera = View::default().camera(&ball(center, radius), aspect);
            let seen = camera.transform.inverse().transform_point3(center);
            // The ball in the middle, within 40 degrees, and as much less as the picture is narrow.
            assert!(seen.x.abs() + seen.y.abs() < 1e-9 * radius && seen.z < 0.0, "{seen}");
            let half = 20f64.to_radians().tan() * f64::min(aspect, 1.0);
            assert!((radius / -seen.z).asin() < half.atan());
            assert!((camera.transform.matrix3.determinant() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_view_is_the_one_that_is_asked_for() {
        let from = Some(DVec3::new(0.0, 4.0, 0.0));
        let view =
            View { look_from: from, look_at: Some(DVec3::new(0.0, 1.0, 0.0)), fov: Some(90.0), ..View::default() };
        assert!(view.without_place().is_none() && View::default().without_place().is_none());
        let nowhere = View { look_from: None, ..View { fov: Some(90.0), ..View::default() } };
        assert_eq!(nowhere.without_place(), Some("--fov"));
        let camera = view.camera(&ball(DVec3::ZERO, 1.0), 1.0);
        // Straight down, which leaves no horizon.
        assert_eq!(camera.transform.transform_vector3(DVec3::NEG_Z), DVec3::NEG_Y);
        assert_eq!(Some(camera.transform.translation), from);
    }
}
