//! Work on two items at a time, for samples whose programs use one processor each.

use anyhow::Result;
use std::iter;
use std::panic::resume_unwind;
use std::sync::{Mutex, PoisonError};
use std::thread;

/// Prepares and runs each item, two at a time, and returns the results in the order of the items.
///
/// Items are prepared one after the other, in their order: a preparation may use a file that the
/// next one overwrites, and what it prints has the same order every time. All items are run, also
/// after a failure.
pub fn in_pairs<Item, Prepared, Output: Send>(
    items: impl Iterator<Item = Item> + Send,
    prepare: impl Fn(Item) -> Result<Prepared> + Sync,
    run: impl Fn(Prepared) -> Result<Output> + Sync,
) -> Vec<Result<Output>> {
    let remaining = Mutex::new(items.enumerate());
    let next = || {
        // Held until the item is prepared.
        let mut remaining = remaining.lock().unwrap_or_else(PoisonError::into_inner);
        remaining.next().map(|(number, item)| (number, prepare(item)))
    };
    let worker = || -> Vec<_> {
        let prepared = iter::from_fn(next);
        prepared.map(|(number, prepared)| (number, prepared.and_then(&run))).collect()
    };
    let mut results = thread::scope(|scope| {
        let second = scope.spawn(worker);
        let first = worker();
        let second = second.join().unwrap_or_else(|panic| resume_unwind(panic));
        [first, second].into_iter().flatten().collect::<Vec<_>>()
    });
    results.sort_by_key(|(number, _)| *number);
    results.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::ensure;
    use std::sync::Barrier;

    #[test]
    fn results_have_the_order_of_the_items() {
        let prepared = Mutex::new(Vec::new());
        // Both threads wait here: one alone would never go on.
        let both = Barrier::new(2);
        let results = in_pairs(
            0..4,
            |item| {
                prepared.lock().unwrap().push(item);
                Ok(item)
            },
            |item| {
                both.wait();
                ensure!(item != 1, "one");
                Ok(10 * item)
            },
        );
        let results: Vec<_> =
            results.into_iter().map(|result| result.map_err(|error| error.to_string())).collect();
        assert_eq!(results, [Ok(0), Err("one".to_owned()), Ok(20), Ok(30)]);
        assert_eq!(prepared.into_inner().unwrap(), [0, 1, 2, 3]);
    }
}
