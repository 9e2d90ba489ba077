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

/// Runs `work` once on each of `threads` workers and waits for all of them, to the end of their threads: a host may
/// unload the library or leave a namespace next.
pub fn broadcast(threads: usize, work: impl Fn(usize) + Sync) -> Result<(), Failed> {
    let mut started = Vec::new();
    let spawn = |worker: rayon::ThreadBuilder| {
        let name = worker.name().unwrap_or_default().to_owned();
        let run = || {
            Arithmetic::DEFAULT.set();
            worker.run();
        };
        started.push(std::thread::Builder::new().name(name).spawn(run)?);
        Ok(())
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("caustica-{i}"))
        .spawn_handler(spawn)
        .build()
        .map_err(|error| Failed::Threads(error.to_string()));
    let outcome = pool.and_then(|pool| {
        let all = || drop(pool.broadcast(|context| work(context.index())));
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(all))
            .map_err(|payload| Failed::Panic(panic_message(&*payload)))
    });
    // The pool is gone, so its threads end; their own panics were caught above.
    started.into_iter().for_each(|thread| drop(thread.join()));
    outcome
}

/// The text of a caught panic.
pub fn panic_message(payload: &(dyn std::any::Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|s| (*s).to_owned());
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_else(|| "panic".to_owned())
}
