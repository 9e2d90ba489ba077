//! Worker threads: our own, joined before the call that made them returns. Rayon's global pool is
//! never touched, since it belongs to the host.

/// Threads to use for a request: 0 means as many as the process may use (affinity and cgroup limits
/// included).
pub fn thread_count(requested: usize) -> usize {
    match requested {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    }
}

/// Why work was not done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failed {
    /// The system gave no more threads, and why.
    Threads(String),
    /// A worker panicked, with this message.
    Panic(String),
}

/// Runs `work` once on each of `threads` workers and waits for all of them.
pub fn broadcast(threads: usize, work: impl Fn(usize) + Sync) -> Result<(), Failed> {
    let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("caustica-{i}"))
            .build_scoped(
                |worker| {
                    default_floating_point();
                    worker.run();
                },
                |pool| {
                    pool.broadcast(|context| work(context.index()));
                },
            )
            .map_err(|error| Failed::Threads(error.to_string()))
    }));
    match outcome {
        Ok(result) => result,
        Err(payload) => Err(Failed::Panic(panic_message(&*payload))),
    }
}

/// The text of a caught panic.
pub fn panic_message(payload: &(dyn std::any::Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|s| (*s).to_owned());
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_else(|| "panic".to_owned())
}

/// A host linked with `-ffast-math` starts with flush-to-zero set and threads inherit it, which would
/// make the image depend on the host's compiler flags. Rust code assumes the default state, and this
/// restores it.
#[allow(unsafe_code)]
fn default_floating_point() {
    #[cfg(target_arch = "x86_64")]
    {
        let default: u32 = 0x1f80;
        // SAFETY: loads the control and status register of this thread, which no Rust code has run on
        // before, with the value that Rust code assumes.
        unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &default, options(nostack, readonly)) };
    }
}
