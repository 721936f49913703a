//! A sweep over pairs of floats: the processor's instructions beside the machine's integers.

use bittybuzz_vm_core::number::{Full, Profile, compute, operation};

use crate::batch::Header;
use crate::report::{End, Report};
use crate::trace::Trace;

/// Pairs of a block.
pub const BLOCK_PAIRS: u32 = 100_000;

/// The length in a header that asks for a sweep in place of an image, which is shorter.
const SWEEP: u16 = u16::MAX;

/// Bits of floats at the edges of their classes: zeros, subnormal numbers, powers of two, infinities, NaN.
const EDGES: [u32; 16] = [
    0x0000_0000,
    0x8000_0000,
    0x0000_0001,
    0x8000_0001,
    0x007f_ffff,
    0x0080_0000,
    0x3f80_0000,
    0xbf80_0000,
    0x3f7f_ffff,
    0x4b80_0000,
    0x7f7f_ffff,
    0xff7f_ffff,
    0x7f80_0000,
    0xff80_0000,
    0x7fc0_0000,
    0x0100_0000,
];

/// Returns the header that asks for a block of the sweep in place of a batch.
pub fn header_of_block(block: u32) -> Header {
    Header { length: SWEEP, budget: 0, slices: block }
}

/// Computes the block for which a header asks. Returns the hash of all results, and the number of pairs for
/// which instructions and integers differ in place of the slices; `None` if the header is that of an image.
pub fn sweep(header: Header) -> Option<Report> {
    if header.length != SWEEP {
        return None;
    }
    let mut pairs = Pairs::of_block(header.slices);
    let (mut trace, mut differences) = (Trace::default(), 0);
    for _ in 0..BLOCK_PAIRS {
        let [x, y] = pairs.next();
        differences += u32::from(!is_same(x, y, compute, &mut trace));
    }
    Some(Report { hash: trace.hash(), slices: differences, end: End::Complete })
}

/// Returns true if `compute` gives the results of the integers for a pair.
fn is_same(
    x: f32,
    y: f32,
    compute: impl Fn(u8, f32, f32) -> Option<f32>,
    trace: &mut Trace,
) -> bool {
    let mut is_same = true;
    for operation in [operation::ADD, operation::SUB, operation::MUL, operation::DIV] {
        let result = compute(operation, x, y).map_or(0, Full::float_from_f32);
        trace.add(result);
        let mut number = Full::unpack(x.to_bits());
        number.operate(operation, &Full::unpack(y.to_bits()));
        let expected = Full::pack(&number);
        // The integers round a product to 32 bits first, after which it may be the float beside the nearest.
        let allowed = u32::from(operation == operation::MUL);
        is_same &= result.abs_diff(expected) <= allowed;
    }
    let order = x.partial_cmp(&y);
    trace.add(order.map_or(2, |order| order as u32));
    is_same && order == Full::unpack(x.to_bits()).compare(&Full::unpack(y.to_bits()))
}

/// Pairs of floats: half of random bits, the others of near exponents, with short significands, or at edges.
struct Pairs {
    state: u32,
    number: u32,
}

impl Pairs {
    fn of_block(block: u32) -> Self {
        Pairs { state: block.wrapping_mul(0x9e37_79b1) | 1, number: 0 }
    }

    /// Xorshift (Marsaglia, "Xorshift RNGs", 2003).
    fn bits(&mut self) -> u32 {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 17;
        self.state ^= self.state << 5;
        self.state
    }

    fn next(&mut self) -> [f32; 2] {
        let (x, y, more) = (self.bits(), self.bits(), self.bits());
        self.number = self.number.wrapping_add(1);
        let edge = |bits: u32| EDGES.get(bits as usize % EDGES.len()).copied().unwrap_or(0);
        let [x, y] = match self.number % 8 {
            // Exponents that differ by at most 3, where sums cancel.
            0 | 1 => {
                [x, y & 0x80ff_ffff | (x & 0x7f80_0000).wrapping_add(more << 23 & 0x0180_0000)]
            }
            2 => [x & 0xffff_0000, y & 0xfff0_0000],
            3 => [x & 0x807f_ffff | more & 0x0080_0000, y],
            4 => [edge(x), if more & 1 == 0 { y } else { edge(y) }],
            _ => [x, y],
        };
        [f32::from_bits(x), f32::from_bits(y)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_has_every_class_and_order() {
        let mut pairs = Pairs::of_block(1);
        let (mut classes, mut orders) = ([0; 5], [0; 4]);
        for _ in 0..BLOCK_PAIRS {
            let [x, y] = pairs.next();
            classes[x.classify() as usize] += 1;
            orders[x.partial_cmp(&y).map_or(3, |order| (order as i8 + 1) as usize)] += 1;
        }
        assert!(classes.iter().all(|count| *count > 100), "{classes:?}");
        assert!(orders.iter().all(|count| *count > 100), "{orders:?}");
    }

    #[test]
    fn the_host_computes_as_its_integers_do() {
        let report = sweep(header_of_block(0)).unwrap();
        assert_eq!(report.slices, 0);
        assert_ne!(sweep(header_of_block(1)), Some(report));
        assert_eq!(sweep(Header { length: 8, budget: 1, slices: 1 }), None);
    }

    #[test]
    fn an_instruction_with_another_last_bit_is_noticed() {
        let mut trace = Trace::default();
        for wrong in [operation::ADD, operation::SUB, operation::DIV] {
            let other = |operation, x, y| {
                let result = compute(operation, x, y)?;
                Some(if operation == wrong { result.next_up() } else { result })
            };
            assert!(is_same(1.5, 0.3, compute, &mut trace));
            assert!(!is_same(1.5, 0.3, other, &mut trace), "operation {wrong}");
        }
        // The integers may differ by one bit, and the hash shows it.
        let [mut right, mut wrong] = [Trace::default(); 2];
        let other = |operation, x, y| {
            let result = compute(operation, x, y)?;
            Some(if operation == operation::MUL { result.next_up() } else { result })
        };
        is_same(1.5, 0.3, compute, &mut right);
        is_same(1.5, 0.3, other, &mut wrong);
        assert_ne!(right.hash(), wrong.hash());
    }
}
