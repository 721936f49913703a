//! Bodies: how each kind of robot moves, and what it knows of where it is.

mod crazyflie;
mod kilobot;
mod zooid;

pub use crazyflie::{CrazyflieModel, Flight, Positioning, Velocity};
pub use kilobot::{KilobotModel, KilobotMotors};
pub use zooid::{Wheels, ZooidModel};

/// What a brain moves its robot with.
#[derive(Debug)]
pub enum Actuators<'a> {
    /// Of a Kilobot.
    Kilobot(&'a mut KilobotMotors),
    /// Of a Zooid.
    Zooid(&'a mut Wheels),
    /// Of a Crazyflie.
    Crazyflie(&'a mut Flight),
}
