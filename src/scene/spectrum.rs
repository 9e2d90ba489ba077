//! Glass whose index varies over the spectrum: a sample sees all of the scene in light of one band.

use super::description::{Material, Medium, Scattering};
use super::textured;
use super::world::walked;
use crate::math::Rgb;
use crate::math::spectrum::{self, bands};
use crate::scatter::Bsdf;

/// The scene in light of one band.
pub struct Band {
    /// Nanometres.
    pub wavelength: f64,
    /// Its colour: what a path that met glass of such an index is multiplied by.
    pub color: Rgb,
    /// In place of [`super::World::media`].
    pub media: Vec<Medium>,
    /// In place of [`super::World::bsdfs`].
    pub bsdfs: Vec<Bsdf>,
    /// In place of those of [`super::World::walked`].
    pub walked: Option<Vec<Bsdf>>,
}

/// All of them, and what differs.
pub struct Spectrum {
    /// From violet to red.
    pub bands: Vec<Band>,
    /// By material: whether its index varies.
    pub dispersive: Vec<bool>,
}

impl Medium {
    /// The same in light of one wavelength, in nanometres.
    pub fn at(self, wavelength: f64) -> Medium {
        if self.abbe == 0.0 {
            return self;
        }
        Medium { ior: spectrum::index(self.ior, self.abbe, wavelength), abbe: 0.0, ..self }
    }
}

impl Scattering {
    /// The same in light of one wavelength, in nanometres.
    pub fn at(mut self, wavelength: f64) -> Scattering {
        if !self.disperses() {
            return self;
        }
        match &mut self {
            Scattering::Dielectric { inside, outside, .. } => {
                (*inside, *outside) = (inside.at(wavelength), outside.at(wavelength));
            }
            Scattering::MetallicRoughness(m) => {
                m.ior = spectrum::index(m.ior, m.abbe, wavelength);
                m.abbe = 0.0;
            }
            _ => {}
        }
        self
    }

    /// Whether its index varies over the spectrum.
    pub fn disperses(&self) -> bool {
        match self {
            Scattering::Dielectric { inside, outside, .. } => inside.abbe != 0.0 || outside.abbe != 0.0,
            Scattering::MetallicRoughness(m) => m.abbe != 0.0 && m.solid && m.transmission > 0.0 && m.metallic < 1.0,
            _ => false,
        }
    }
}

impl Spectrum {
    /// If any of the materials disperses; `with_walked` materials, if the world has those.
    pub(super) fn new(materials: &[Material], media: &[Medium], with_walked: bool) -> Option<Spectrum> {
        let dispersive: Vec<bool> = materials.iter().map(|m| m.scattering.disperses()).collect();
        if !dispersive.contains(&true) {
            return None;
        }
        let band = |spectrum::Band { wavelength, color }| {
            let materials: Vec<Material> =
                materials.iter().map(|m| Material { scattering: m.scattering.at(wavelength), ..m.clone() }).collect();
            let bsdfs: Vec<Bsdf> = materials.iter().map(textured::factors).collect();
            let media = media.iter().map(|medium| medium.at(wavelength)).collect();
            Band { wavelength, color, media, walked: walked(&materials, &bsdfs).filter(|_| with_walked), bsdfs }
        };
        Some(Spectrum { bands: bands().into_iter().map(band).collect(), dispersive })
    }
}
