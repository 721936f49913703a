//! Directions, and the conversion of a vector to its length and direction.

/// A direction or a turn, anticlockwise, in 1/65536 of a whole turn. The integer wraps around like
/// the angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Angle(pub i16);

impl Angle {
    /// A quarter of a turn.
    pub const QUARTER: Angle = Angle(0x4000);

    /// Half a turn.
    const HALF: Angle = Angle(i16::MIN);

    /// Returns the sum.
    pub const fn plus(self, other: Angle) -> Angle {
        Angle(self.0.wrapping_add(other.0))
    }

    /// Returns the difference.
    pub const fn minus(self, other: Angle) -> Angle {
        Angle(self.0.wrapping_sub(other.0))
    }

    /// Returns the absolute value, at most half a turn.
    pub const fn magnitude(self) -> u16 {
        self.0.unsigned_abs()
    }

    /// Returns the angle in 65536ths of a turn, in (-32768, 32768]. Half a turn is positive.
    pub const fn signed(self) -> i32 {
        if self.0 == Angle::HALF.0 { 1 << 15 } else { self.0 as i32 }
    }
}

/// The arc tangents of 1, 1/2, 1/4 and so on.
static ARC_TANGENTS: [i16; 14] = [8192, 4836, 2555, 1297, 651, 326, 163, 81, 41, 20, 10, 5, 3, 1];

/// The limit of the coordinates of a short vector, and the number of bits by which it is scaled up.
const SHORT: u32 = 1 << 12;
const SHORT_SHIFT: u32 = 7;

/// Returns the length and the direction of a vector that is shorter than 2^20; the direction is 0
/// if the vector is zero. The error of the direction is below 0.1 degrees, and that of the length
/// is below one unit and 3 parts in 10,000.
///
/// The function uses CORDIC (Volder 1959): it turns the vector by ever smaller angles until it
/// points along x, which takes only shifts and sums. Together the turns make the vector longer by a
/// factor of 1.64676.
pub fn polar(x: i32, y: i32) -> (i32, Angle) {
    if x == 0 && y == 0 {
        return (0, Angle(0));
    }
    // Short vectors are scaled up, since the turns need more bits.
    let finer = if x.unsigned_abs().max(y.unsigned_abs()) < SHORT { SHORT_SHIFT } else { 0 };
    let (x, y) = (x << finer, y << finer);
    let (mut x, mut y, mut angle) = if x < 0 { (-x, -y, Angle::HALF) } else { (x, y, Angle(0)) };
    for (step, arc_tangent) in ARC_TANGENTS.iter().enumerate() {
        let (across, along) = (x >> step, y >> step);
        if y > 0 {
            (x, y, angle) = (x + along, y - across, angle.plus(Angle(*arc_tangent)));
        } else {
            (x, y, angle) = (x - along, y + across, angle.minus(Angle(*arc_tangent)));
        }
    }
    // 2487 / 4096 = 1 / 1.64695
    (((x.unsigned_abs() * 2487) >> (12 + finer)) as i32, angle)
}
