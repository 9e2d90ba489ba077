//! The image of a render that still runs.

use super::passes::Passes;
use super::{Image, Plane, RenderError};
use std::sync::{Arc, Mutex, PoisonError};

/// Shows what a render has; shared between threads.
#[derive(Default)]
pub struct Preview(Mutex<Option<Arc<Passes>>>);

impl Preview {
    /// From now on, what is in these.
    pub(super) fn show(&self, passes: &Arc<Passes>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(passes.clone());
    }

    /// Nothing any more: for whoever has the output, and the film's memory back.
    pub fn close(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    fn passes(&self) -> Option<Arc<Passes>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Share of the tiles that is done, whole passes, and the noise of their average, if there is something to show.
    pub fn progress(&self) -> Option<(f32, u32, f32)> {
        let passes = self.passes()?;
        let (samples, noise) = passes.noise();
        Some((passes.fraction(), samples, noise))
    }

    /// The average over the whole passes so far, and their number; `None` before the first and where it was closed.
    /// Workers that finish a tile wait meanwhile.
    pub fn image(&self, plane: Plane) -> Result<Option<(Image, u32)>, RenderError> {
        self.passes().map_or(Ok(None), |passes| passes.image(plane))
    }
}
