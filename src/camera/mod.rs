//! Cameras: primary rays, and the importance that a point in the scene has for the film.

#[cfg(test)]
mod tests;

use crate::geometry::SurfacePoint;
use crate::math::{Sampler, warp};
use crate::scene::description::{self, Lens};
use glam::{DVec2, DVec3, UVec2, Vec2, Vec3};
use std::borrow::Cow;

/// Where a path ends: on a surface, at a point in space, or at infinity.
#[derive(Clone, Copy, Debug)]
pub enum Endpoint {
    /// On a surface.
    Surface(SurfacePoint),
    /// A pinhole or a point light.
    Point(Vec3),
    /// Parallel light or projection: the unit direction from the scene toward the endpoint.
    Infinite(Vec3),
}

impl Endpoint {
    /// Its position; the origin for an end at infinity, whose position plays no part.
    #[inline]
    pub fn position(&self) -> Vec3 {
        match self {
            Endpoint::Surface(at) => at.p,
            Endpoint::Point(p) => *p,
            Endpoint::Infinite(_) => Vec3::ZERO,
        }
    }
}

/// How the camera sees a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraConnection {
    /// Raster position; pixel (0, 0) of the frame covers `[0, 1)²` at its top left.
    pub raster: Vec2,
    /// From the point toward the camera, unit.
    pub wi: Vec3,
    /// Where the segment to the camera ends.
    pub target: Vec3,
    /// Density, per perpendicular area at the point, with which primary rays over the film reach it: pinhole
    /// `1/(A_1 cos³ d²)`, parallel `1/A_film`. With a box filter this is also the importance over the number of the film's
    /// pixels.
    pub density: f64,
}

/// A rectangle of pixels of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Columns of the frame left of it.
    pub x: u32,
    /// Rows of the frame above it.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Region {
    /// All of a frame.
    pub fn all(width: u32, height: u32) -> Region {
        Region { x: 0, y: 0, width, height }
    }

    /// Whether it has pixels, all of them in this frame.
    pub fn is_within(&self, width: u32, height: u32) -> bool {
        let inside = |start: u32, length: u32, all: u32| length > 0 && start < all && length <= all - start;
        inside(self.x, self.width, width) && inside(self.y, self.height, height)
    }

    /// Number in it of the pixel in that column and row of the frame.
    pub fn number(&self, x: u32, y: u32) -> Option<u32> {
        let (column, row) = (x.checked_sub(self.x)?, y.checked_sub(self.y)?);
        (column < self.width && row < self.height).then(|| row * self.width + column)
    }

    /// Number of pixels.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

/// As X11 writes it: `WIDTHxHEIGHT+X+Y`.
impl std::fmt::Display for Region {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}+{}+{}", self.width, self.height, self.x, self.y)
    }
}

/// A camera with its frame, and the part of that which is its film.
#[derive(Clone, Debug)]
pub struct Camera {
    origin: Vec3,
    /// Unit, to the right on the film.
    right: Vec3,
    /// Unit, to the top of the film.
    up: Vec3,
    /// Unit, into the scene.
    forward: Vec3,
    projection: Projection,
    /// Half the frame's width and height: at unit distance for a pinhole, in metres for a parallel
    /// projection.
    half_frame: Vec2,
    /// The film's area, in the same unit.
    film_area: f64,
    /// The frame's size in pixels.
    pixels: Vec2,
    /// The film's edges in pixels of the frame: left and top, right and bottom.
    film: [Vec2; 2],
    /// The frame's middle, to the right and down, in the unit of `half_frame`.
    middle: Vec2,
    lens: Option<Lens>,
}

#[derive(Clone, Copy, Debug)]
enum Projection {
    Pinhole,
    Parallel,
}

impl Camera {
    /// From a validated description, the size of a frame in pixels, and the region of it that is film.
    pub fn new(description: &description::Camera, width: u32, height: u32, region: Region) -> Camera {
        let axes = description.transform.matrix3;
        // Up is kept in the plane of the given z and y; right follows, so that no transform mirrors.
        let back = axes.z_axis.normalize_or(DVec3::Z);
        let up = axes.y_axis.reject_from_normalized(back).try_normalize();
        let up = up.unwrap_or_else(|| back.any_orthonormal_vector());
        let (projection, half_height) = match description.projection {
            description::Projection::Perspective { yfov } => (Projection::Pinhole, (0.5 * yfov).tan()),
            description::Projection::Orthographic { ymag } => (Projection::Parallel, ymag),
        };
        let half_width = half_height * f64::from(width) / f64::from(height);
        let corner = UVec2::new(region.x, region.y);
        let middle = 2.0 * half_height * description.shift;
        let share = region.pixels() as f64 / Region::all(width, height).pixels() as f64;
        Camera {
            origin: description.transform.translation.as_vec3(),
            right: up.cross(back).as_vec3(),
            up: up.as_vec3(),
            forward: (-back).as_vec3(),
            projection,
            half_frame: DVec2::new(half_width, half_height).as_vec2(),
            film_area: 4.0 * half_width * half_height * share,
            pixels: UVec2::new(width, height).as_vec2(),
            film: [corner, corner + UVec2::new(region.width, region.height)].map(|edge| edge.as_vec2()),
            middle: DVec2::new(middle.x, -middle.y).as_vec2(),
            lens: description.lens,
        }
    }

    /// The camera of one sample: behind a point of the lens, uniform for uniform `u`, lies a pinhole whose film is moved so
    /// that all of them see the plane of focus alike (Potmesil and Chakravarty 1981; Cook, Porter, Carpenter 1984). All
    /// techniques of a sample share that point, so its density cancels in measurement and weights.
    fn through(&self, lens: &Lens, u: Vec2) -> Camera {
        let at = warp::disk(u).as_dvec2() * lens.radius;
        let origin = self.origin.as_dvec3() + self.right.as_dvec3() * at.x - self.up.as_dvec3() * at.y;
        let middle = (self.middle.as_dvec2() - at / lens.focus).as_vec2();
        Camera { origin: origin.as_vec3(), middle, lens: None, ..self.clone() }
    }

    /// The camera of one sample: itself, unless it has a lens, of which a point is drawn.
    #[inline]
    pub fn sample(&self, numbers: &mut Sampler) -> Cow<'_, Camera> {
        match &self.lens {
            Some(lens) => Cow::Owned(self.through(lens, numbers.next_2d())),
            None => Cow::Borrowed(self),
        }
    }

    /// Whether all primary rays leave one point.
    pub fn is_point(&self) -> bool {
        matches!(self.projection, Projection::Pinhole) && self.lens.is_none()
    }

    /// The primary ray through a raster position: origin and unit direction. Its sampling weight is 1.
    #[inline]
    pub fn generate(&self, raster: Vec2) -> (Vec3, Vec3) {
        let film = (2.0 * raster / self.pixels - Vec2::ONE) * self.half_frame + self.middle;
        let offset = self.right * film.x - self.up * film.y;
        match self.projection {
            Projection::Pinhole => (self.origin, (self.forward + offset).normalize()),
            Projection::Parallel => (self.origin + offset, self.forward),
        }
    }

    /// The endpoint a path through this camera has: its pinhole or its direction of view.
    #[inline]
    pub fn endpoint(&self) -> Endpoint {
        match self.projection {
            Projection::Pinhole => Endpoint::Point(self.origin),
            Projection::Parallel => Endpoint::Infinite(-self.forward),
        }
    }

    /// The density of [`CameraConnection`] for a point that lies `distance` along the primary ray
    /// with unit direction `direction`.
    #[inline]
    pub fn density(&self, direction: Vec3, distance: f32) -> f64 {
        match self.projection {
            Projection::Pinhole => {
                let cos = self.forward.as_dvec3().dot(direction.as_dvec3());
                if cos > 0.0 { 1.0 / (self.film_area * cos.powi(3) * f64::from(distance).powi(2)) } else { 0.0 }
            }
            Projection::Parallel => 1.0 / self.film_area,
        }
    }

    /// How the camera sees `p`, if `p` projects onto the film.
    #[inline]
    pub fn connect(&self, p: Vec3) -> Option<CameraConnection> {
        let v = p.as_dvec3() - self.origin.as_dvec3();
        let (raster, depth) = self.project(v)?;
        let (wi, target, distance) = match self.projection {
            Projection::Pinhole => {
                let distance = v.length();
                ((v / -distance).as_vec3(), self.origin, distance)
            }
            Projection::Parallel => (-self.forward, p - self.forward * depth as f32, depth),
        };
        Some(CameraConnection { raster, wi, target, density: self.density(-wi, distance as f32) })
    }

    /// Where a pinhole sees what lies in a direction, if that projects onto the film. A point in that direction would
    /// not do: far from the origin its rounding is a pixel.
    #[inline]
    pub fn raster_of(&self, direction: Vec3) -> Option<Vec2> {
        self.project(direction.as_dvec3()).map(|(raster, _)| raster)
    }

    /// Distance of `p` along the direction of view, metres.
    pub fn depth(&self, p: Vec3) -> f32 {
        (p.as_dvec3() - self.origin.as_dvec3()).dot(self.forward.as_dvec3()) as f32
    }

    /// The raster position of what lies at `v` from the camera, if it is on the film, and its depth.
    #[inline]
    fn project(&self, v: DVec3) -> Option<(Vec2, f64)> {
        let depth = v.dot(self.forward.as_dvec3());
        if depth <= 0.0 {
            return None;
        }
        let film = DVec2::new(v.dot(self.right.as_dvec3()), -v.dot(self.up.as_dvec3()));
        let film = match self.projection {
            Projection::Pinhole => film / depth,
            Projection::Parallel => film,
        } - self.middle.as_dvec2();
        let raster = 0.5 * (film.as_vec2() / self.half_frame + Vec2::ONE) * self.pixels;
        let inside = raster.cmpge(self.film[0]).all() && raster.cmplt(self.film[1]).all();
        inside.then_some((raster, depth))
    }
}
