//! Multiple importance sampling: the balance heuristic over all techniques that can make a path
//! (Veach 1997, §9.2), in the streaming form of Georgiev et al. 2012 on the compressed path of
//! Speierer et al. 2018, §3.3 (recursion after van Antwerpen 2011).
//!
//! The compressed path has the connectable vertices `z_0` (camera) to `z_m` (light); chains of
//! non-connectable vertices between them are macro-edges. With `F_i` the density of `z_i` generated
//! from the camera side, `R_i` from the light side, and `a_i` the indicator (times sample count) of the
//! technique that joins `z_i` and `z_{i+1}`,
//!
//! ```text
//! P_i = a_i Π_{j<=i} F_j Π_{j>i} R_j        w_i = P_i / Σ_j P_j
//! e_i = Σ_{j<i} P_j / P_i' = (a_{i-1} + R_{i-1} e_{i-1}) / F_i
//! g_i = Σ_{j>=i} P_j / P_i' = (a_i + F_{i+1} g_{i+1}) / R_i
//! ```
//!
//! `a_0`, of the light image (t = 1), has a factor where the path is direct light: [`light_image`].
//!
//! The primes stand for "a left out". `e_i` is linear in the one density that is unknown when `z_i` is
//! made (that of going back from `z_i`), so a vertex keeps two numbers: [`Partial`].
//!
//! Pure functions of densities; the measure is area at the vertex, or solid angle at infinity.

/// Direct light in the light image counts so much of its density, where next-event estimation finds it for sure. The
/// balance heuristic minimises second moments; of next-event estimation, whose samples in a pixel are alike and evenly
/// spread, the variance is a small part of that, of splats nearly all (Grittmann et al. 2019). Measured in
/// docs/decisions/0006: 0.3 brings less, 0.03 no more; for longer paths and through rough glass it costs.
const DIRECT_IMAGE: f64 = 0.1;

/// Factor of `a_0`, a function of the path: whether it is direct light, `m = 2`, whose last macro-edge is
/// [`sure`](super::vertex::EdgeRecord::sure).
#[inline]
pub fn light_image(direct: bool) -> f64 {
    if direct { DIRECT_IMAGE } else { 1.0 }
}

/// `e_i` (or `g_i`) of the newest vertex of a subpath, as a function of the density `p` per solid
/// angle with which the path would turn back from it: `alpha + gamma p`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Partial {
    /// Constant part: the technique across the last macro-edge.
    pub alpha: f64,
    /// Factor of the reverse density: all techniques before.
    pub gamma: f64,
}

impl Partial {
    /// The value, once the reverse density per solid angle is known.
    #[inline]
    pub fn at(&self, reverse_density: f64) -> f64 {
        self.alpha + self.gamma * reverse_density
    }
}

/// A macro-edge that a subpath has just sampled, with what the weights need to know of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MacroEdge {
    /// `a`: whether, or with how many samples per path, the technique across this edge exists.
    pub technique: f64,
    /// Density of the new vertex, area measure.
    pub forward: f64,
    /// What turns a solid-angle density at the new vertex, toward the old one, into the density of
    /// the old vertex: geometry factor times the lobe probabilities of the chain.
    pub reverse_geometry: f64,
    /// The old vertex's `e` or `g`, complete.
    pub remainder: f64,
}

impl MacroEdge {
    /// Closes the edge at its new vertex.
    #[inline]
    pub fn close(&self) -> Partial {
        Partial { alpha: self.technique / self.forward, gamma: self.reverse_geometry * self.remainder / self.forward }
    }

    /// The first edge of a light subpath. The technique across it is next-event estimation, which
    /// draws the light vertex with density `direct` (`D`) instead of `position` (`R_m`); the one
    /// beyond it is hitting the light, if it can be hit.
    #[inline]
    pub fn from_light(
        technique: f64,
        forward: f64,
        reverse_geometry: f64,
        direct: f64,
        position: f64,
        hittable: bool,
    ) -> MacroEdge {
        MacroEdge {
            technique: technique * direct / position,
            forward,
            reverse_geometry,
            remainder: if hittable { 1.0 / position } else { 0.0 },
        }
    }
}

/// Weight of a connection of two subpath vertices `z_i`, `z_{i+1}` (also of a light vertex with the
/// camera, where `camera_side` is 0). `camera_side = R_i e_i`, `light_side = F_{i+1} g_{i+1}`.
#[inline]
pub fn connection(technique: f64, camera_side: f64, light_side: f64) -> f64 {
    finite_share(technique, camera_side + light_side)
}

/// Weight of next-event estimation. `direct` is `D`; `emission = R_m R_{m-1} e_{m-1}`;
/// `hit = F_m a_m`.
#[inline]
pub fn next_event(technique: f64, direct: f64, emission: f64, hit: f64) -> f64 {
    finite_share(technique * direct, emission + hit)
}

/// Weight of a camera path that hit a light, from the partial closed at the light vertex, `D`, and
/// the emission densities `R_m` (position) and of the direction.
#[inline]
pub fn emitter_hit(partial: Partial, direct: f64, position: f64, direction: f64) -> f64 {
    finite_share(1.0, direct * partial.alpha + position * direction * partial.gamma)
}

/// `own / (own + others)`; an infinite rest means that this technique has no share.
#[inline]
fn finite_share(own: f64, others: f64) -> f64 {
    if others == f64::INFINITY { 0.0 } else { own / (own + others) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Sampler, Stream};

    /// A path as the definition sees it: all densities, all indicators.
    struct Abstract {
        forward: Vec<f64>,   // F_0 ..= F_m; F_0 unused
        reverse: Vec<f64>,   // R_0 ..= R_m
        technique: Vec<f64>, // a_0 .. a_{m-1}
        direct: f64,         // D
        hit: f64,            // a_m
    }

    impl Abstract {
        /// Length 1 to 12, densities over eighteen decades, some techniques missing, sometimes a delta
        /// light; some technique always exists, as for any path that was sampled.
        fn random(s: &mut Sampler) -> Abstract {
            let m = 1 + (s.next_1d() * 12.0) as usize;
            let density = |s: &mut Sampler| 10f64.powf(18.0 * s.next_1d() as f64 - 9.0);
            let indicator = |s: &mut Sampler| match (s.next_1d() * 4.0) as u32 {
                0 => 0.0,
                1 => 0.05 + s.next_1d() as f64,
                _ => 1.0,
            };
            let mut technique: Vec<f64> = (0..m).map(|_| indicator(s)).collect();
            let hit = if s.next_1d() < 0.3 { 0.0 } else { 1.0 };
            if hit == 0.0 && technique.iter().all(|&a| a == 0.0) {
                technique[0] = 1.0;
            }
            Abstract {
                forward: (0..=m).map(|_| density(s)).collect(),
                reverse: (0..=m).map(|_| density(s)).collect(),
                technique,
                direct: density(s),
                hit,
            }
        }

        fn m(&self) -> usize {
            self.technique.len()
        }

        /// The definition: every P_i as a product, in logarithms so that nothing overflows.
        fn brute_force(&self) -> Vec<f64> {
            let m = self.m();
            let log_p: Vec<f64> = (0..=m)
                .map(|i| {
                    let a = if i < m { self.technique[i] } else { self.hit };
                    let forward: f64 = (1..=i).map(|j| self.forward[j].ln()).sum();
                    let reverse: f64 = (i + 1..=m)
                        .map(|j| if i == m - 1 && j == m { self.direct.ln() } else { self.reverse[j].ln() })
                        .sum();
                    a.ln() + forward + reverse
                })
                .collect();
            let largest = log_p.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let sum: f64 = log_p.iter().map(|l| (l - largest).exp()).sum();
            log_p.iter().map(|l| (l - largest).exp() / sum).collect()
        }

        /// The streaming form. Each density is split into solid angle and geometry at random, since
        /// that is how the renderer feeds it.
        fn streaming(&self, s: &mut Sampler) -> Vec<f64> {
            let m = self.m();
            let split: Vec<f64> = (0..=m).map(|_| 0.1 + s.next_1d() as f64).collect();
            // Camera partials of z_1 ..= z_m; R_{i-1} = split * geometry.
            let mut camera = vec![Partial::default(); m + 1];
            for i in 1..=m {
                let remainder = if i == 1 { 0.0 } else { camera[i - 1].at(split[i - 2]) };
                let edge = MacroEdge {
                    technique: self.technique[i - 1],
                    forward: self.forward[i],
                    reverse_geometry: self.reverse[i - 1] / split[i - 1],
                    remainder,
                };
                camera[i] = edge.close();
            }
            // Light partials of z_{m-1} down to z_1; F_{i+1} = split * geometry.
            let mut light = vec![Partial::default(); m + 1];
            for i in (1..m).rev() {
                let geometry = self.forward[i + 1] / split[i + 1];
                let edge = if i == m - 1 {
                    MacroEdge::from_light(
                        self.technique[i],
                        self.reverse[i],
                        geometry,
                        self.direct,
                        self.reverse[m],
                        self.hit > 0.0,
                    )
                } else {
                    MacroEdge {
                        technique: self.technique[i],
                        forward: self.reverse[i],
                        reverse_geometry: geometry,
                        remainder: light[i + 1].at(split[i + 2]),
                    }
                };
                light[i] = edge.close();
            }
            let mut w = vec![0.0; m + 1];
            for i in 0..m {
                // e_i, complete: the reverse density at z_i toward z_{i-1} is split[i - 1].
                let e = if i == 0 { 0.0 } else { camera[i].at(split[i - 1]) };
                w[i] = if self.technique[i] == 0.0 {
                    0.0
                } else if i == m - 1 {
                    let emission = self.reverse[m] * self.reverse[m - 1] * e;
                    next_event(self.technique[i], self.direct, emission, self.forward[m] * self.hit)
                } else {
                    let g = light[i + 1].at(split[i + 2]);
                    connection(self.technique[i], self.reverse[i] * e, self.forward[i + 1] * g)
                };
            }
            if self.hit > 0.0 {
                // R_{m-1} is split in the partial: direction density times geometry.
                w[m] = emitter_hit(camera[m], self.direct, self.reverse[m], split[m - 1]);
            }
            w
        }
    }

    #[test]
    fn streaming_weights_are_the_definition_and_sum_to_one() {
        let mut s = Sampler::new(1, 0, 0, Stream::Camera);
        let mut worst = (0.0f64, 0.0f64);
        for _ in 0..20_000 {
            let path = Abstract::random(&mut s);
            let (fast, slow) = (path.streaming(&mut s), path.brute_force());
            for (f, b) in fast.iter().zip(&slow) {
                worst.0 = worst.0.max((f - b).abs());
            }
            worst.1 = worst.1.max((fast.iter().sum::<f64>() - 1.0).abs());
        }
        assert!(worst.0 < 1e-12, "streaming against brute force: {}", worst.0);
        assert!(worst.1 < 1e-12, "sum of the weights: {}", worst.1);
    }

    #[test]
    fn overflowing_ratios_give_a_weight_and_not_a_nan() {
        assert_eq!(connection(1.0, f64::INFINITY, 1.0), 0.0);
        assert_eq!(emitter_hit(Partial { alpha: f64::INFINITY, gamma: 0.0 }, 1.0, 1.0, 1.0), 0.0);
    }
}
