//! A queue of measurements on their way.

/// Measurements with the step at which each arrives, oldest first. It holds at most `N`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct DelayLine<T, const N: usize> {
    /// The first `count` entries from `first` on, around the end, are in use.
    entries: [Option<(u64, T)>; N],
    first: usize,
    count: usize,
}

impl<T: Copy, const N: usize> DelayLine<T, N> {
    pub(super) const fn new() -> Self {
        DelayLine { entries: [None; N], first: 0, count: 0 }
    }

    /// Adds a measurement that arrives at this step. A full queue loses it.
    pub(super) fn push(&mut self, arrival: u64, item: T) {
        if self.count < N {
            self.entries[(self.first + self.count) % N] = Some((arrival, item));
            self.count += 1;
        }
    }

    /// Returns the oldest measurement if it has arrived by this step.
    pub(super) fn pop(&mut self, now: u64) -> Option<T> {
        let (_, item) = self.entries[self.first].filter(|(arrival, _)| *arrival <= now)?;
        self.entries[self.first] = None;
        self.first = (self.first + 1) % N;
        self.count -= 1;
        Some(item)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_arrive_in_order_and_on_time() {
        let mut line = DelayLine::<u8, 2>::new();
        assert_eq!(line.pop(100), None);
        for round in 0..5 {
            let start = 10 * round;
            line.push(start + 3, 1);
            line.push(start + 5, 2);
            line.push(start + 6, 3); // Lost: the queue is full.
            assert_eq!(line.pop(start + 2), None);
            assert_eq!(line.pop(start + 5), Some(1));
            assert_eq!(line.pop(start + 5), Some(2));
            assert_eq!(line.pop(start + 9), None);
        }
    }
}
