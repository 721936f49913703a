//! Stamps, which determine the later one of two values of a stigmergy entry.
//!
//! Among stamps whose clocks lie within half the circle the order is total. Replicas that take the
//! greater of their own stamp and a received one therefore become equal, even if messages are lost,
//! duplicated or reordered.
//!
//! The clock is a serial number as in RFC 1982: the clock after [`CLOCK_MAX`] is 1. A clock counts
//! as later than all those up to half the circle before it. There is thus no last clock, and a
//! forged clock wins only until the next put. The price is that replicas of a key that are more
//! than 2,097,151 puts apart compare in the wrong direction, which one put per step reaches after
//! 58 hours of separation.

use core::cmp::Ordering;

use crate::message::CLOCK_MAX;
use crate::number::Profile;
use crate::value::Value;

/// The rank of an entry among the entries of the same key.
#[derive(Clone, Copy, Debug)]
pub struct Stamp<P: Profile> {
    /// The Lamport clock of the put.
    pub clock: u32,
    /// The robot that put the value.
    pub robot: u16,
    /// The value, nil if it was deleted.
    pub value: Value<P>,
    /// The digest of key and value, computed when the value is put; 0 if the entry fits a frame,
    /// where the bits of the value decide.
    pub digest: u16,
}

/// Returns the clock after this one.
#[one_copy]
pub fn next(clock: u32) -> u32 {
    if clock < CLOCK_MAX { clock + 1 } else { 1 }
}

/// Returns true if clock `a` is earlier than clock `b`. The clock 0, at which nothing was put, is
/// earlier than all others.
#[one_copy]
pub fn is_earlier(a: u32, b: u32) -> bool {
    if a == 0 || b == 0 {
        return a < b;
    }
    // The circle has an odd number of clocks, so no two clocks are opposite to each other.
    let is_near = a.abs_diff(b) <= CLOCK_MAX / 2;
    (a < b) == is_near
}

impl<P: Profile> Stamp<P> {
    /// Returns the order of two stamps. The later clock is the greater one. At equal clocks a value
    /// is greater than nil, and then the higher robot id is greater. A robot that lost its memory
    /// may have put two values at the same clock: then their types decide, and after them the bits
    /// of plain values and the digests of other values.
    pub fn order(&self, other: &Self) -> Ordering {
        // Each part needs one comparison; an `Ordering` would take an AVR two.
        let (mine, theirs) = (self.value, other.value);
        let is_less = if self.clock != other.clock {
            is_earlier(self.clock, other.clock)
        } else if mine.is_nil() != theirs.is_nil() {
            mine.is_nil()
        } else if self.robot != other.robot {
            self.robot < other.robot
        } else if mine.tag() != theirs.tag() {
            mine.tag().byte() < theirs.tag().byte()
        } else if !mine.is_heap() && mine.raw() != theirs.raw() {
            mine.raw() < theirs.raw()
        } else if self.digest != other.digest {
            self.digest < other.digest
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

    /// Returns the stamp of a replica after it received another.
    fn join(known: Stamp<Tiny>, heard: Stamp<Tiny>) -> Stamp<Tiny> {
        if heard.order(&known) == Ordering::Greater { heard } else { known }
    }

    const TAGS: &[Tag] = &[Tag::NIL, Tag::INT, Tag::FLOAT, Tag::STRING, Tag::TABLE, Tag::TEXT];

    /// Clocks on both sides of the end of the circle.
    fn clocks() -> impl Strategy<Value = u32> {
        prop_oneof![Just(CLOCK_MAX - 1), Just(CLOCK_MAX), Just(1), Just(2)]
    }

    /// Makes stamps from few values of each part, so that many are equal in some parts.
    fn stamps() -> impl Strategy<Value = Stamp<Tiny>> {
        (clocks(), 1..3_u16, prop::sample::select(TAGS), 0..3_u16).prop_map(
            |(clock, robot, tag, content)| {
                let is_heap = tag == Tag::TABLE || tag == Tag::TEXT;
                // A nil has zero bits only. A value on the heap has a digest, and its cell has no
                // meaning.
                let raw = if tag == Tag::NIL || is_heap { 0 } else { content };
                let digest = if is_heap { content } else { 0 };
                Stamp { clock, robot, value: Value::new(tag, raw), digest }
            },
        )
    }

    fn same(one: Stamp<Tiny>, other: Stamp<Tiny>) -> bool {
        one.clock == other.clock
            && one.robot == other.robot
            && one.value.same(other.value)
            && one.digest == other.digest
    }

    proptest! {
        #[test]
        fn merging_is_idempotent(a in stamps()) {
            prop_assert!(same(join(a, a), a));
        }

        #[test]
        fn merging_is_commutative(a in stamps(), b in stamps()) {
            prop_assert!(same(join(a, b), join(b, a)));
            prop_assert_eq!(a.order(&b), b.order(&a).reverse());
        }

        #[test]
        fn merging_is_associative(a in stamps(), b in stamps(), c in stamps()) {
            prop_assert!(same(join(join(a, b), c), join(a, join(b, c))));
        }

        #[test]
        fn a_later_clock_wins_for_any_value(a in stamps(), b in stamps()) {
            // Among these clocks the high ones are the earlier ones.
            let expected = (a.clock.wrapping_add(5) % CLOCK_MAX).cmp(&(b.clock.wrapping_add(5) % CLOCK_MAX));
            prop_assert!(expected == Ordering::Equal || a.order(&b) == expected);
        }

        #[test]
        fn of_two_clocks_exactly_one_is_earlier(a in 1..=CLOCK_MAX, b in 1..=CLOCK_MAX) {
            prop_assert_eq!(is_earlier(a, b), a != b && !is_earlier(b, a));
        }

        #[test]
        fn the_next_put_is_later_than_any_known_clock(clock in 0..=CLOCK_MAX) {
            prop_assert!((1..=CLOCK_MAX).contains(&next(clock)));
            prop_assert!(is_earlier(clock, next(clock)));
        }
    }

    #[test]
    fn half_the_circle_is_later_and_half_is_earlier() {
        assert!(is_earlier(1, 1 + CLOCK_MAX / 2));
        assert!(!is_earlier(1, 2 + CLOCK_MAX / 2));
        assert!(is_earlier(CLOCK_MAX, 1));
        assert!(is_earlier(0, CLOCK_MAX) && !is_earlier(CLOCK_MAX, 0) && !is_earlier(0, 0));
    }
}
