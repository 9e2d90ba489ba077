//! Orthonormal frames.

use glam::Vec3;

/// A right-handed orthonormal frame; `n` is the local z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Local x axis.
    pub s: Vec3,
    /// Local y axis.
    pub t: Vec3,
    /// Local z axis, unit.
    pub n: Vec3,
}

impl Frame {
    /// The frame around a unit vector, without a branch that could lose digits near a pole
    /// (Duff et al. 2017, "Building an orthonormal basis, revisited").
    #[inline]
    pub fn around(n: Vec3) -> Frame {
        let sign = 1.0f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Frame {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// World to local.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// Local to world.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed_everywhere() {
        let mut worst = 0.0f32;
        for i in 0..4000 {
            // A spiral over the sphere, both poles included.
            let z = (1.0 - 2.0 * (i as f32) / 3999.0).clamp(-1.0, 1.0);
            let phi = i as f32 * 2.399_963;
            let r = (1.0 - z * z).max(0.0).sqrt();
            let n = Vec3::new(r * phi.cos(), r * phi.sin(), z).normalize();
            let f = Frame::around(n);
            worst = worst.max((f.s.cross(f.t) - f.n).length());
            worst = worst.max(f.s.dot(f.t).abs()).max(f.s.dot(f.n).abs());
            worst = worst.max((f.s.length() - 1.0).abs()).max((f.t.length() - 1.0).abs());
            let v = Vec3::new(0.3, -0.7, 0.2);
            worst = worst.max((f.to_world(f.to_local(v)) - v).length());
        }
        assert!(worst < 1e-6, "worst deviation {worst}");
    }
}
