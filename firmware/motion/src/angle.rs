//! Directions, and the one calculation with them: from a vector to its length and direction.

/// A direction or a turn, anticlockwise, in 1/65536 of a whole turn: it wraps around by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Angle(pub i16);

impl Angle {
    /// A quarter of a turn.
    pub const QUARTER: Angle = Angle(0x4000);

    /// Half a turn, in which directions are from just above -180 to 180 degrees.
    const HALF: Angle = Angle(i16::MIN);

    /// The sum.
    pub const fn plus(self, other: Angle) -> Angle {
        Angle(self.0.wrapping_add(other.0))
    }

    /// The difference.
    pub const fn minus(self, other: Angle) -> Angle {
        Angle(self.0.wrapping_sub(other.0))
    }

    /// Returns the distance from 0, at most half a turn.
    pub const fn magnitude(self) -> u16 {
        self.0.unsigned_abs()
    }

    /// Returns the angle as a number of 65536ths in (-32768, 32768]: half a turn is positive.
    pub const fn signed(self) -> i32 {
        if self.0 == Angle::HALF.0 { 1 << 15 } else { self.0 as i32 }
    }
}

/// The arc tangents of 1, 1/2, 1/4 and so on.
static ARC_TANGENTS: [i16; 14] = [8192, 4836, 2555, 1297, 651, 326, 163, 81, 41, 20, 10, 5, 3, 1];

/// Parts of a short vector, and by how many bits it is made longer.
const SHORT: u32 = 1 << 12;
const FINER: u32 = 7;

/// Length and direction of a vector that is shorter than 2^20; direction 0 if it is zero. The errors are below 0.1 degrees, and
/// below one unit and 3 parts in 10,000.
///
/// CORDIC (Volder 1959): turns the vector by ever smaller angles until it points along x, which takes only shifts and sums.
/// The turns make it longer, altogether by 1.64676.
pub fn polar(x: i32, y: i32) -> (i32, Angle) {
    if x == 0 && y == 0 {
        return (0, Angle(0));
    }
    // Short ones have more bits to be turned with.
    let finer = if x.unsigned_abs().max(y.unsigned_abs()) < SHORT { FINER } else { 0 };
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
