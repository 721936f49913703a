//! Boxes and cylinders, seen from above.

/// An obstacle of the scenario. Lengths are in mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    /// The id in the experiment.
    pub name: String,
    pub at: [f64; 2],
    pub shape: Shape,
    pub height: f64,
    /// True if robots push it, which must be a disc.
    pub is_movable: bool,
    /// The line of the experiment.
    pub line: usize,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    Disc {
        radius: f64,
    },
    /// A rectangle.
    Block {
        size: [f64; 2],
        /// Degrees from 0 to 180, counterclockwise: half a turn leaves a rectangle as it is.
        heading: f64,
    },
}

impl Shape {
    /// Returns the shape after a turn by these degrees. A quarter turn exchanges the sides.
    pub fn turned(self, degrees: f64) -> Self {
        match self {
            Shape::Disc { .. } => self,
            Shape::Block { size: [x, y], heading } => {
                // A thousandth of a degree is far below the errors of any robot.
                let heading = ((heading + degrees) * 1e3).round().rem_euclid(180e3) / 1e3;
                match heading == 90.0 {
                    true => Shape::Block { size: [y, x], heading: 0.0 },
                    false => Shape::Block { size: [x, y], heading },
                }
            }
        }
    }

    /// Returns the radius of the smallest circle around it.
    pub fn radius(self) -> f64 {
        match self {
            Shape::Disc { radius } => radius,
            Shape::Block { size: [x, y], .. } => x.hypot(y) / 2.0,
        }
    }
}

impl Obstacle {
    /// Returns the distance from a point to the obstacle; at most 0 inside.
    pub fn gap(&self, point: [f64; 2]) -> f64 {
        let [x, y] = [point[0] - self.at[0], point[1] - self.at[1]];
        match self.shape {
            Shape::Disc { radius } => x.hypot(y) - radius,
            Shape::Block { size, heading } => {
                let (sine, cosine) = heading.to_radians().sin_cos();
                let along = [x * cosine + y * sine, y * cosine - x * sine];
                let beyond = |axis: usize| (along[axis].abs() - size[axis] / 2.0).max(0.0);
                beyond(0).hypot(beyond(1))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(heading: f64) -> Shape {
        Shape::Block { size: [40.0, 20.0], heading: 0.0 }.turned(heading)
    }

    #[test]
    fn turns_of_rectangles() {
        let upright = Shape::Block { size: [20.0, 40.0], heading: 0.0 };
        assert_eq!(block(90.0), upright);
        assert_eq!(block(-90.0), upright);
        assert_eq!(block(540.0), block(0.0));
        assert_eq!(block(212.1), Shape::Block { size: [40.0, 20.0], heading: 32.1 });
        assert_eq!(block(-0.0001), block(0.0));
    }

    #[test]
    fn gaps_to_a_turned_rectangle() {
        let obstacle = |shape| Obstacle {
            name: String::new(),
            at: [100.0, 0.0],
            shape,
            height: 1.0,
            is_movable: false,
            line: 1,
        };
        let near = |one: f64, other: f64| assert!((one - other).abs() < 1e-9, "{one} {other}");
        // The right side is at 120, the corner at (120, 10).
        near(obstacle(block(0.0)).gap([150.0, 0.0]), 30.0);
        near(obstacle(block(0.0)).gap([123.0, 14.0]), 5.0);
        near(obstacle(block(0.0)).gap([110.0, 5.0]), 0.0);
        // After 45 degrees the long axis has this direction, and ends 20 from the center.
        let end = 100.0 + 50.0 / 2.0_f64.sqrt();
        near(obstacle(block(45.0)).gap([end, 50.0 / 2.0_f64.sqrt()]), 30.0);
        near(obstacle(Shape::Disc { radius: 10.0 }).gap([100.0, 30.0]), 20.0);
    }
}
