//! Threads that share the work of a tick.
//!
//! A WebAssembly module has a single thread, so the pool is empty there.

#[cfg(not(target_family = "wasm"))]
use rayon::prelude::*;

/// A pool of threads, or the caller's thread alone.
#[derive(Clone, Debug)]
pub(crate) struct Pool {
    #[cfg(not(target_family = "wasm"))]
    threads: Option<std::sync::Arc<rayon::ThreadPool>>,
}

impl Pool {
    /// Returns a pool of `count` threads; 0 stands for one per processor. If the system gives no
    /// threads, the caller's thread does the work.
    #[cfg(not(target_family = "wasm"))]
    pub(crate) fn new(count: usize) -> Self {
        let threads = match count {
            1 => None,
            _ => rayon::ThreadPoolBuilder::new().num_threads(count).build().ok(),
        };
        Pool { threads: threads.map(std::sync::Arc::new) }
    }

    #[cfg(target_family = "wasm")]
    pub(crate) fn new(_: usize) -> Self {
        Pool {}
    }

    /// Calls `work` with every item, in any order. A single item is processed on the caller's
    /// thread, because waking another thread takes longer.
    pub(crate) fn each<T: Send>(
        &self,
        items: impl ExactSizeIterator<Item = T>,
        work: impl Fn(T) + Send + Sync,
    ) {
        #[cfg(not(target_family = "wasm"))]
        if let Some(threads) = &self.threads
            && items.len() > 1
        {
            let items: Vec<T> = items.collect();
            threads.install(|| items.into_par_iter().for_each(work));
            return;
        }
        items.for_each(work);
    }
}
