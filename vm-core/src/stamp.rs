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
    /// was started anew may have put two values at the same clock: then their types and bits decide. Values of one type on
    /// the heap are equal for this.
    pub fn order(&self, other: &Self) -> Ordering {
        // One comparison for each part: an order of three takes an AVR two.
        let (mine, theirs) = (self.value, other.value);
        let is_less = if self.clock != other.clock {
            self.clock < other.clock
        } else if mine.is_nil() != theirs.is_nil() {
            mine.is_nil()
        } else if self.robot != other.robot {
            self.robot < other.robot
        } else if mine.tag() != theirs.tag() {
            mine.tag().byte() < theirs.tag().byte()
        } else if !mine.is_heap() && mine.raw() != theirs.raw() {
            mine.raw() < theirs.raw()
        } else {
            return Ordering::Equal;
        };
        if is_less { Ordering::Less } else { Ordering::Greater }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::number::Tiny;
    use crate::value::Tag;
    use proptest::prelude::*;

    /// What a replica has after another stamp was heard.
    fn join(known: Stamp<Tiny>, heard: Stamp<Tiny>) -> Stamp<Tiny> {
        if heard.order(&known) == Ordering::Greater { heard } else { known }
    }

    const TAGS: &[Tag] = &[Tag::NIL, Tag::INT, Tag::FLOAT, Tag::STRING, Tag::TABLE, Tag::TEXT];

    /// Few of each kind, so that many are equal in part.
    fn stamps() -> impl Strategy<Value = Stamp<Tiny>> {
        (0..3_u32, 1..3_u16, prop::sample::select(TAGS), 0..3_u16).prop_map(
            |(clock, robot, tag, raw)| {
                // Of a nil all bits are zero; all tables are one table here.
                let raw =
                    if tag == Tag::NIL || tag == Tag::TABLE || tag == Tag::TEXT { 0 } else { raw };
                Stamp { clock, robot, value: Value::new(tag, raw) }
            },
        )
    }

    fn same(one: Stamp<Tiny>, other: Stamp<Tiny>) -> bool {
        one.clock == other.clock && one.robot == other.robot && one.value.same(other.value)
    }

    proptest! {
        #[test]
        fn what_is_heard_twice_changes_nothing(a in stamps()) {
            prop_assert!(same(join(a, a), a));
        }

        #[test]
        fn it_does_not_matter_what_is_heard_first(a in stamps(), b in stamps()) {
            prop_assert!(same(join(a, b), join(b, a)));
            prop_assert_eq!(a.order(&b), b.order(&a).reverse());
        }

        #[test]
        fn it_does_not_matter_who_heard_it(a in stamps(), b in stamps(), c in stamps()) {
            prop_assert!(same(join(join(a, b), c), join(a, join(b, c))));
        }

        #[test]
        fn a_later_clock_wins_whatever_is_put(a in stamps(), b in stamps()) {
            let expected = a.clock.cmp(&b.clock);
            prop_assert!(expected == Ordering::Equal || a.order(&b) == expected);
        }
    }
}
