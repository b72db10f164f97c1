//! The same work on many things, side by side; what comes of it doesn't depend on the number of threads.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

/// Returns what comes of each number, in order; `None` if `stop` is raised meanwhile. Each thread works with what
/// `begin` makes.
pub(crate) fn in_order<S, T: Send>(
    numbers: std::ops::Range<usize>,
    n_threads: usize,
    stop: &AtomicBool,
    begin: impl Fn() -> S + Sync + Send,
    one: impl Fn(&mut S, usize) -> T + Sync + Send,
) -> Option<Vec<T>> {
    let unless_stopped = |state: &mut S, k: usize| {
        if stop.load(Ordering::Relaxed) { None } else { Some(one(state, k)) }
    };
    let pool = ThreadPoolBuilder::new().num_threads(n_threads.max(1)).build();
    let pool = pool.expect("the operating system has threads");
    pool.install(|| {
        numbers.into_par_iter().with_max_len(1).map_init(begin, unless_stopped).collect()
    })
}
