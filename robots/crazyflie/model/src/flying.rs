//! A Crazyflie in flight.
use crate::Flight;

/// The commands by which a brain flies the body, and the voltage that it measures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlightControls {
    /// The command for the flight controller.
    pub flight: Flight,
    /// Voltage of the battery in mV that a scenario has set.
    pub battery_setting_mv: Option<u16>,
    /// Voltage of the battery in mV.
    pub battery_mv: u16,
}
