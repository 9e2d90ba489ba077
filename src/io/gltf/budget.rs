//! A bound on what a file may unfold to.

use super::error::{GltfError, Object};

/// Memory that the description of a file may still take.
///
/// Views into one buffer may overlap, accessors may be zeros without any bytes, one long name may stand
/// at each of many nodes: a small file can describe more than any machine holds. Honest files stay
/// far below the bound: a vertex of a strip takes at least one byte and becomes at most 52.
pub(super) struct Budget {
    left: u64,
    limit: u64,
}

impl Budget {
    /// 128 bytes for each byte read, and 512 MiB for files that are small.
    pub(super) fn of_input(bytes: usize) -> Self {
        let limit = (bytes as u64).saturating_mul(128).saturating_add(512 << 20);
        Budget { left: limit, limit }
    }

    /// Takes `count` items of `size` bytes, before they are allocated for `object`.
    pub(super) fn charge(&mut self, count: usize, size: usize, object: &Object) -> Result<(), GltfError> {
        let bytes = (count as u64).saturating_mul(size as u64);
        match self.left.checked_sub(bytes) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => Err(object.invalid(
                "memory needed",
                format!("{bytes} bytes"),
                format!("the bound is {} bytes in all, from the size of the file", self.limit),
            )),
        }
    }
}

/// An empty list with room for `count` items, or an error where the memory is lacking.
pub(super) fn reserve<T>(count: usize, object: &Object) -> Result<Vec<T>, GltfError> {
    let mut list = Vec::new();
    let refuse = |_| GltfError::OutOfMemory { object: Box::new(object.clone()), count };
    list.try_reserve_exact(count).map_err(refuse)?;
    Ok(list)
}
