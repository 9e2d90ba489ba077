//! How a thread computes in floating point.
//!
//! A host linked with `-ffast-math` sets flush-to-zero, threads inherit it, and the image would depend on the host's
//! compiler. Rust code may assume the default, and changing it to anything else is undefined behaviour: it only changes
//! to the default, before code of ours computes, and back to what the host had, after it has. In between, the
//! assumption holds.
#![allow(unsafe_code)]

/// The control and status register of SSE arithmetic; on other processors nothing.
#[derive(Clone, Copy)]
pub(crate) struct Arithmetic {
    #[cfg(target_arch = "x86_64")]
    mxcsr: u32,
}

impl Arithmetic {
    /// All exceptions masked, round to nearest, no flush to zero, no exception flag raised.
    pub(crate) const DEFAULT: Arithmetic = Arithmetic {
        #[cfg(target_arch = "x86_64")]
        mxcsr: 0x1f80,
    };

    /// That of this thread.
    #[inline]
    pub(crate) fn of_thread() -> Arithmetic {
        #[cfg(target_arch = "x86_64")]
        {
            let mut mxcsr = 0u32;
            // SAFETY: stores four bytes to a local.
            unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut mxcsr, options(nostack, preserves_flags)) };
            Arithmetic { mxcsr }
        }
        #[cfg(not(target_arch = "x86_64"))]
        Arithmetic::DEFAULT
    }

    /// For this thread from now on.
    #[inline]
    pub(crate) fn set(self) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: loads either the default, or a value that `of_thread` read and that therefore has no reserved bit set;
        // see the module's comment for why the change is allowed.
        unsafe {
            std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const self.mxcsr, options(nostack, readonly));
        }
    }
}
