//! Quaternions of 32 bits, as Bitcraze packs them (quatcompress.h of crazyflie-firmware).
//!
//! Two bits name the largest part of x, y, z, w; the sign of the quaternion is chosen so that this
//! part is positive. Each other part has a sign and 9 bits: its share of sqrt(1/2), the largest
//! value of a part that is not the largest. The parts follow each other from the highest bits on.

use core::f32::consts::FRAC_1_SQRT_2;

use crate::refusal::Refusal;

/// Bits of a part with its sign.
const PART_BITS: u32 = 10;
const SIGN: u32 = 1 << 9;
const MAGNITUDE: u32 = SIGN - 1;

/// Returns the quaternion x, y, z, w in these bits, which has length 1.
///
/// # Errors
/// Refuses parts whose squares exceed 1 in sum, so that there is no largest part.
pub(crate) fn unpack(packed: u32) -> Result<[f32; 4], Refusal> {
    let largest = (packed >> 30) as usize;
    let mut quaternion = [0.0; 4];
    let mut rest = packed;
    let mut squares = 0.0;
    for (number, part) in quaternion.iter_mut().enumerate().rev() {
        if number == largest {
            continue;
        }
        let size = (rest & MAGNITUDE) as f32 / MAGNITUDE as f32 * FRAC_1_SQRT_2;
        *part = if rest & SIGN == 0 { size } else { -size };
        squares += size * size;
        rest >>= PART_BITS;
    }
    if squares > 1.0 {
        return Err(Refusal::NotUnit);
    }
    if let Some(part) = quaternion.get_mut(largest) {
        *part = libm::sqrtf(1.0 - squares);
    }
    Ok(quaternion)
}

/// Packs a quaternion x, y, z, w of length 1. The error of a part is at most half of 1/511 of
/// sqrt(1/2), and up to three times that for the largest.
pub fn pack_quaternion(quaternion: [f32; 4]) -> u32 {
    let mut largest = (0, 0.0);
    for (number, part) in (0..).zip(quaternion) {
        if part.abs() > f32::abs(largest.1) {
            largest = (number, part);
        }
    }
    let mut packed = largest.0;
    for (number, part) in (0..).zip(quaternion) {
        if number == largest.0 {
            continue;
        }
        let size = (part.abs() / FRAC_1_SQRT_2 * MAGNITUDE as f32 + 0.5) as u32;
        let sign = if (part < 0.0) == (largest.1 < 0.0) { 0 } else { SIGN };
        packed = packed << PART_BITS | sign | size.min(MAGNITUDE);
    }
    packed
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From `compress_quaternion` of cflib 0.1.34 (cflib/utils/encoding.py).
    #[test]
    fn quaternions_that_cflib_packed() {
        let cases = [
            ([0.0, 0.0, 0.0, 1.0], 0xc000_0000),
            ([0.0, 0.0, 1.0, 0.0], 0x8000_0000),
            ([0.5, 0.5, 0.5, 0.5], 0x1695_a569),
            ([-0.102_597_8, 0.205_195_7, -0.307_793_5, 0.923_380_5], 0xe4a2_52de),
            ([0.704_916_3, -0.100_702_3, -0.100_702_3, -0.694_846_1], 0x2499_27f6),
            ([0.0, 0.0, 0.8, -0.6], 0x8000_03b2),
        ];
        for (quaternion, packed) in cases {
            assert_eq!(pack_quaternion(quaternion), packed, "{quaternion:?}");
            let negative = quaternion.map(|part| -part);
            assert_eq!(unpack(pack_quaternion(negative)), unpack(packed), "the same rotation");
            let unpacked = unpack(packed).unwrap();
            // Half of a step of the 9 bits; the largest part has up to three times that error.
            let error = unpacked.iter().zip(quaternion).map(|(a, b)| (a - b).abs());
            assert!(error.fold(0.0, f32::max) < 3.0 * 0.5 / 511.0, "{unpacked:?}");
        }
    }

    #[test]
    fn anything_can_be_packed() {
        for part in [0.0, f32::NAN, f32::INFINITY, f32::MAX, -f32::MAX] {
            // A quaternion that is none still gives 32 bits.
            pack_quaternion([part; 4]);
        }
        assert_eq!(unpack(pack_quaternion([0.0; 4])), Ok([1.0, 0.0, 0.0, 0.0]));
    }

    #[test]
    fn parts_beyond_length_1_are_refused() {
        // Three parts of sqrt(1/2) have squares of 1.5 in sum.
        assert_eq!(unpack(0x1ff << 20 | 0x1ff << 10 | 0x1ff), Err(Refusal::NotUnit));
        // Two of them leave 0 for the largest.
        assert!(unpack(0x1ff << 10 | 0x1ff).is_ok());
        for packed in (0..=u32::MAX).step_by(65_521) {
            if let Ok(quaternion) = unpack(packed) {
                let square: f32 = quaternion.iter().map(|part| part * part).sum();
                assert!((square - 1.0).abs() < 1e-5, "{packed:#x}");
            }
        }
    }
}
