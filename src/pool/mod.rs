//! Worker threads: our own, joined before the call that made them returns. Rayon's global pool is
//! never touched, since it belongs to the host.

pub(crate) mod arithmetic;

use arithmetic::Arithmetic;

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
                    Arithmetic::DEFAULT.set();
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
