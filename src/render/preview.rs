//! The image of a render that still runs.

use super::Image;
use super::RenderError;
use super::passes::Passes;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Shows what a render has; shared between threads.
#[derive(Default)]
pub struct Preview(Mutex<Weak<Passes>>);

impl Preview {
    /// From now on, what is in these.
    pub(super) fn show(&self, passes: &Arc<Passes>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Arc::downgrade(passes);
    }

    /// Share of the tiles that is done, whole passes, and the noise of their average; `None` after the end.
    pub fn progress(&self) -> Option<(f32, u32, f32)> {
        let passes = self.0.lock().unwrap_or_else(PoisonError::into_inner).upgrade()?;
        let (samples, noise) = passes.noise();
        Some((passes.fraction(), samples, noise))
    }

    /// The average over the whole passes so far, and their number; `None` before the first and after the end. Workers that
    /// finish a tile wait meanwhile.
    pub fn image(&self) -> Result<Option<(Image, u32)>, RenderError> {
        let passes = self.0.lock().unwrap_or_else(PoisonError::into_inner).upgrade();
        passes.map_or(Ok(None), |passes| passes.image())
    }
}
