//! The same work on many things, side by side; what comes of it doesn't depend on the number of threads.

use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

/// What comes of each number, in order. Each thread works with what `begin` makes.
pub(crate) fn in_order<S, T: Send>(
    numbers: std::ops::Range<usize>,
    n_threads: usize,
    begin: impl Fn() -> S + Sync + Send,
    one: impl Fn(&mut S, usize) -> T + Sync + Send,
) -> Vec<T> {
    let pool = ThreadPoolBuilder::new().num_threads(n_threads.max(1)).build();
    let pool = pool.expect("the operating system has threads");
    pool.install(|| numbers.into_par_iter().with_max_len(1).map_init(begin, one).collect())
}
