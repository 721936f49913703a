//! Walls and obstacles.

/// What bodies cannot enter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Obstacle {
    /// A thin wall between two points (mm).
    Segment {
        /// One end.
        from: (f32, f32),
        /// The other end.
        to: (f32, f32),
    },
    /// A round obstacle (mm).
    Round {
        /// Middle.
        x: f32,
        /// Middle.
        y: f32,
        /// Radius.
        radius: f32,
    },
    /// A box with sides along the axes (mm).
    Box {
        /// Middle.
        x: f32,
        /// Middle.
        y: f32,
        /// Along x.
        width: f32,
        /// Along y.
        height: f32,
    },
}
