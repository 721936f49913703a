//! The edge of a range: the share of the frames that are bright enough, which falls with distance
//! as a logistic curve.
//!
//! A frame that is too dim for a receiver does not exist there: it is neither received nor sensed,
//! and disturbs no other frame. Each frame has its own chance at each receiver, which does not
//! depend on the number of times that it is asked for.

use std::sync::LazyLock;

/// The natural logarithm of 9: from the middle of a standard logistic curve to its 90 %.
const LN_9: f32 = 2.197_224_6;

/// The number of half widths around the end of the range in which chance decides. Before it, 98.8 %
/// of the frames are bright enough and all are taken; after it 1.2 %, and none is. More half widths
/// would make the cells larger in which frames are sought: 3 cost 10 % more instructions.
const HALF_WIDTHS: f32 = 2.0;

/// Distances beyond the end of the range in half widths, one of which a frame reaches with a
/// probability of 1/256 each: quantiles of the logistic distribution.
static REACHES: LazyLock<[f32; 256]> = LazyLock::new(|| {
    core::array::from_fn(|number| {
        let share = (number as f32 + 0.5) / 256.0;
        let half_widths = libm::logf((1.0 - share) / share) / LN_9;
        half_widths.clamp(-HALF_WIDTHS, HALF_WIDTHS)
    })
});

/// The edge of a range: squares of distances in mm^2.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    range_mm: f32,
    half_width_mm: f32,
    /// The square of the distance up to which all frames are bright enough.
    begin: f32,
    /// The square of the distance beyond which none is.
    end: f32,
}

/// Returns the distance beyond which no frame is bright enough, in mm.
pub(crate) fn farthest_mm(range_mm: f32, half_width_mm: f32) -> f32 {
    range_mm + HALF_WIDTHS * half_width_mm
}

impl Edge {
    pub(crate) fn new(range_mm: f32, half_width_mm: f32) -> Self {
        let begin_mm = (range_mm - HALF_WIDTHS * half_width_mm).max(0.0);
        let end_mm = farthest_mm(range_mm, half_width_mm);
        Edge { range_mm, half_width_mm, begin: begin_mm * begin_mm, end: end_mm * end_mm }
    }

    pub(crate) fn range_mm(&self) -> f32 {
        self.range_mm
    }

    /// Returns true if chance decides at some distance.
    pub(crate) fn is_soft(&self) -> bool {
        self.half_width_mm > 0.0
    }

    /// Returns true if a frame is bright enough at a distance, which is given as its square. `key`
    /// is random and belongs to the frame.
    pub(crate) fn reaches(&self, squared: f32, key: u64, receiver: u16) -> bool {
        squared <= self.begin || squared <= self.end && self.is_bright(squared, key, receiver)
    }

    fn is_bright(&self, squared: f32, key: u64, receiver: u16) -> bool {
        // Odd constants mix the bits, as in SplitMix64.
        let mut mixed = key ^ u64::from(receiver).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        mixed = (mixed ^ (mixed >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
        let reach_mm = self.range_mm + REACHES[(mixed >> 56) as usize] * self.half_width_mm;
        squared <= reach_mm * reach_mm.max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::stream::Stream;

    /// The share of frames that reach this far.
    fn share(edge: &Edge, distance_mm: f32) -> f32 {
        let mut stream = Stream::for_brain(1, 1);
        let count = 40_000;
        let reaches = |number: u32| {
            let receiver = (number % 100) as u16;
            edge.reaches(distance_mm * distance_mm, stream.seed(), receiver)
        };
        (0..count).map(reaches).filter(|reaches| *reaches).count() as f32 / count as f32
    }

    #[test]
    fn the_edge_falls_from_90_to_10_percent() {
        let edge = Edge::new(100.0, 10.0);
        for (distance, expected) in
            [(79.0, 1.0), (90.0, 0.9), (95.0, 0.75), (100.0, 0.5), (110.0, 0.1), (121.0, 0.0)]
        {
            // Three deviations of 40,000 draws, and half of a 256th.
            let found = share(&edge, distance);
            assert!((found - expected).abs() < 0.0095, "{distance}: {found}");
        }
    }

    #[test]
    fn a_range_without_an_edge_ends_sharply() {
        let edge = Edge::new(100.0, 0.0);
        assert!(!edge.is_soft());
        assert_eq!([100.0, 100.01].map(|distance| share(&edge, distance)), [1.0, 0.0]);
        assert_eq!(share(&Edge::new(f32::INFINITY, 0.0), 1e9), 1.0);
        // An edge that is wider than the range.
        let edge = Edge::new(5.0, 1000.0);
        assert!(share(&edge, 1.0) > 0.45 && share(&edge, 1e4) == 0.0);
    }

    /// Receivers of one frame are independent, and so are frames at one receiver.
    #[test]
    fn draws_are_independent() {
        let edge = Edge::new(100.0, 10.0);
        let mut stream = Stream::for_brain(2, 2);
        let count = 20_000;
        let (mut both, mut pairs) = (0, 0);
        for _ in 0..count {
            let key = stream.seed();
            let [one, next, far] = [1, 2, 40_000].map(|receiver| edge.reaches(1e4, key, receiver));
            both += u32::from(one && next);
            pairs += u32::from(next && far);
        }
        for found in [both, pairs].map(|found| found as f32 / count as f32) {
            // Three deviations are 0.0092.
            assert!((found - 0.25).abs() < 0.01, "{found}");
        }
    }
}
