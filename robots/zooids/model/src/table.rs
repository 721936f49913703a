//! The table under the projector, and the part of the world that it lights.

use bittybuzz_arena::engine::Pose;
use bittybuzz_zooids_board::STEP_MM;

/// Columns and rows that are projected, in steps of the code (robots/zooids/board).
const PICTURE: [[f64; 2]; 2] = [[56.0, 967.0], [227.0, 796.0]];

/// Returns the middle of the picture, which is that of the world, in mm from the place where the
/// code is 0.
pub fn middle() -> [f64; 2] {
    [0, 1].map(|axis| PICTURE[axis].iter().sum::<f64>() / 2.0 * STEP_MM[axis])
}

/// Returns true if the projector shines on a robot.
pub fn is_lit(pose: &Pose) -> bool {
    let place = [pose.x, pose.y].map(f64::from);
    [0, 1].into_iter().all(|axis| {
        let [first, last] = PICTURE[axis];
        2.0 * place[axis].abs() <= (last - first) * STEP_MM[axis]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SwarmUI measured the projected area: 883 steps are 812.8 mm, 558 are 508 mm.
    #[test]
    fn light_covers_exactly_the_picture() {
        let [right, up] = [911.0 / 2.0 * 812.8 / 883.0, 569.0 / 2.0 * 508.0 / 558.0];
        let lit = |x: f64, y: f64| is_lit(&Pose::new(x as f32, y as f32, 0.0));
        assert!(lit(right - 0.1, up - 0.1) && lit(0.1 - right, 0.1 - up));
        assert!(!lit(right + 0.1, 0.0) && !lit(0.0, -up - 0.1));
    }
}
