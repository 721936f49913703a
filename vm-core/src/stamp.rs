//! Which of two values of a stigmergy entry is the later one.
//!
//! A total order, so that replicas that take the greater of what they have and what they hear become equal, whatever is
//! lost, doubled or comes in another order.

use core::cmp::Ordering;

use crate::number::Profile;
use crate::value::Value;

/// What an entry is worth.
#[derive(Clone, Copy, Debug)]
pub struct Stamp<P: Profile> {
    /// Lamport's clock.
    pub clock: u32,
    /// Who put the value.
    pub robot: u16,
    /// The value, nil if it was deleted.
    pub value: Value<P>,
}

impl<P: Profile> Stamp<P> {
    /// The higher clock is the later one; at equal clocks a value before nil, then the higher robot id. A robot that
    /// was started anew may have put two values at the same clock: then their types and bits decide. Values on the heap
    /// are equal for this.
    pub fn order(&self, other: &Self) -> Ordering {
        let present = |stamp: &Self| !stamp.value.is_nil();
        self.clock
            .cmp(&other.clock)
            .then_with(|| present(self).cmp(&present(other)))
            .then_with(|| self.robot.cmp(&other.robot))
            .then_with(|| {
                if self.value.is_heap() || other.value.is_heap() {
                    return Ordering::Equal;
                }
                let tags = self.value.tag().byte().cmp(&other.value.tag().byte());
                tags.then_with(|| self.value.raw().cmp(&other.value.raw()))
            })
    }
}
