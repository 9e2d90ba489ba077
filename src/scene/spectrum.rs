//! Glass whose index varies over the spectrum: a sample sees all of the scene in light of one band.

use super::description::{Material, Medium, Scattering};
use super::place::reserve;
use super::world::walked;
use super::{SceneError, textured};
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
    /// Materials whose index varies, in place of those of [`super::World::bsdfs`].
    pub bsdfs: Vec<Bsdf>,
    /// In place of those of [`super::World::walked`].
    pub walked: Option<Vec<Bsdf>>,
}

/// All of them, and what differs.
pub struct Spectrum {
    /// From violet to red.
    pub bands: Vec<Band>,
    /// By material: which of a band's it is, if its index varies.
    pub dispersive: Vec<Option<u32>>,
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
    pub(super) fn new(
        materials: &[Material],
        media: &[Medium],
        with_walked: bool,
    ) -> Result<Option<Spectrum>, SceneError> {
        let mut count = 0;
        let mut position = |m: &Material| {
            let disperses = m.scattering.disperses();
            count += u32::from(disperses);
            disperses.then(|| count - 1)
        };
        let dispersive: Vec<_> = materials.iter().map(&mut position).collect();
        if count == 0 {
            return Ok(None);
        }
        let spectrum = bands();
        let mut bands = reserve(spectrum.len())?;
        for spectrum::Band { wavelength, color } in spectrum {
            let mut varied = reserve(count as usize)?;
            let of_band = |m: &Material| Material { scattering: m.scattering.at(wavelength), ..m.clone() };
            varied.extend(materials.iter().filter(|m| m.scattering.disperses()).map(of_band));
            let mut bsdfs = reserve(varied.len())?;
            bsdfs.extend(varied.iter().map(textured::factors));
            let walked = with_walked.then(|| walked(&varied, &bsdfs).unwrap_or_else(|| bsdfs.clone()));
            let media = media.iter().map(|medium| medium.at(wavelength)).collect();
            bands.push(Band { wavelength, color, media, bsdfs, walked });
        }
        Ok(Some(Spectrum { bands, dispersive }))
    }

    /// Bytes.
    pub(super) fn memory(&self) -> u64 {
        let of_band = |band: &Band| {
            let bsdfs = band.bsdfs.len() + band.walked.as_ref().map_or(0, Vec::len);
            bsdfs * size_of::<Bsdf>() + size_of_val(&band.media[..])
        };
        self.bands.iter().map(of_band).sum::<usize>() as u64
    }
}
