//! Moments at which the supply of a robot with an STM32 falls.

/// The activity of the robot when its supply falls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doing {
    /// After a reset, before or just after the firmware is ready.
    Starting,
    /// The firmware waits for a crystal that does not start.
    WaitingForTheCrystal,
    /// Motors turn, between two messages.
    RunningTheScript,
    /// A message is on its way out.
    Sending,
    /// Messages are on their way in.
    Receiving,
    /// A probe writes another script.
    TakingAScript,
    /// A probe writes another id.
    TakingAnId,
}

impl Doing {
    const ALL: [Self; 7] = [
        Self::Starting,
        Self::WaitingForTheCrystal,
        Self::RunningTheScript,
        Self::Sending,
        Self::Receiving,
        Self::TakingAScript,
        Self::TakingAnId,
    ];

    /// The activity of this try: all of them in turn.
    pub fn of(number: u64) -> Self {
        Self::ALL[(number % 7) as usize]
    }
}
