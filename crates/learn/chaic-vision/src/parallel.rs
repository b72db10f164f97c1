//! Parallel map whose result does not depend on the number of threads.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

/// Maps each index to a value, in order; returns `None` if `stop` is set meanwhile. `init` creates
/// the working state of each thread.
pub(crate) fn map_in_order<S, T: Send>(
    indices: std::ops::Range<usize>,
    n_threads: usize,
    stop: &AtomicBool,
    init: impl Fn() -> S + Sync + Send,
    map: impl Fn(&mut S, usize) -> T + Sync + Send,
) -> Option<Vec<T>> {
    let unless_stopped = |state: &mut S, k: usize| {
        if stop.load(Ordering::Relaxed) { None } else { Some(map(state, k)) }
    };
    let pool = ThreadPoolBuilder::new().num_threads(n_threads.max(1)).build();
    let pool = pool.expect("the operating system has threads");
    pool.install(|| {
        indices.into_par_iter().with_max_len(1).map_init(init, unless_stopped).collect()
    })
}
