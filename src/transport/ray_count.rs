//! How many rays were traced, and what for.

/// Counts rays by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCount {
    /// Primary rays.
    pub camera: u64,
    /// Continuations of camera subpaths.
    pub camera_path: u64,
    /// Segments of light subpaths.
    pub light_path: u64,
    /// Visibility queries.
    pub shadow: u64,
    /// Rays of manifold walks.
    pub walk: u64,
}

impl RayCount {
    /// Rays of all kinds.
    pub fn total(&self) -> u64 {
        self.camera + self.camera_path + self.light_path + self.shadow + self.walk
    }
}

impl std::ops::Add for RayCount {
    type Output = RayCount;
    fn add(self, other: RayCount) -> RayCount {
        RayCount {
            camera: self.camera + other.camera,
            camera_path: self.camera_path + other.camera_path,
            light_path: self.light_path + other.light_path,
            shadow: self.shadow + other.shadow,
            walk: self.walk + other.walk,
        }
    }
}

impl std::ops::Sub for RayCount {
    type Output = RayCount;
    fn sub(self, earlier: RayCount) -> RayCount {
        RayCount {
            camera: self.camera - earlier.camera,
            camera_path: self.camera_path - earlier.camera_path,
            light_path: self.light_path - earlier.light_path,
            shadow: self.shadow - earlier.shadow,
            walk: self.walk - earlier.walk,
        }
    }
}
