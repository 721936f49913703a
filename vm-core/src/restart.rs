//! The pauses before a script starts again after a fault, counted in ticks of a tenth of a second.
//!
//! A script that fails at once would otherwise keep its robot busy with starting, and fill the
//! channel with the messages of `init()`. Each fault doubles the pause, up to a minute. After a
//! minute of completed steps the next pause is short again.

/// Ticks of the first pause: 1 s.
const FIRST: u16 = 10;
/// Ticks of the longest pause: 60 s.
const PAUSE_MAX: u16 = 600;
/// The number of completed steps after which a script counts as healthy: a minute of them.
const HEALTHY: u16 = 600;

/// The timer of the next start. It is all zeros before the first fault.
#[derive(Clone, Copy, Debug, Default)]
pub struct Restarts {
    /// Ticks of the last pause, 0 if the script is healthy.
    pause: u16,
    /// The ticks that are left of the pause; after the pause, the number of steps completed since.
    count: u16,
}

impl Restarts {
    /// Returns the timer of a script without a fault.
    pub const fn new() -> Self {
        Restarts { pause: 0, count: 0 }
    }

    /// Begins the pause after a fault, and returns its ticks.
    pub fn pause(&mut self) -> u16 {
        self.pause = match self.pause {
            0 => FIRST,
            pause => (2 * pause).min(PAUSE_MAX),
        };
        self.count = self.pause;
        self.pause
    }

    /// Counts a tick of the pause. Returns true if the pause is over with it.
    pub fn tick(&mut self) -> bool {
        self.count = self.count.saturating_sub(1);
        self.count == 0
    }

    /// Counts a step that was completed.
    pub fn step(&mut self) {
        self.count += 1;
        if self.count >= HEALTHY {
            self.count = 0;
            self.pause = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the ticks that a pause lasts, counted one by one.
    fn pause(restarts: &mut Restarts) -> u16 {
        let announced = restarts.pause();
        let mut ticks = 1;
        while !restarts.tick() {
            ticks += 1;
        }
        assert_eq!(ticks, announced);
        ticks
    }

    #[test]
    fn pauses_double_from_one_second_to_sixty() {
        let mut restarts = Restarts::new();
        let expected = [10, 20, 40, 80, 160, 320, 600, 600, 600];
        assert_eq!(expected.map(|_| pause(&mut restarts)), expected);
    }

    #[test]
    fn a_minute_of_steps_resets_the_pause() {
        let mut restarts = Restarts::new();
        pause(&mut restarts);
        pause(&mut restarts);
        (0..600).for_each(|_| restarts.step());
        assert_eq!(pause(&mut restarts), 10);
    }

    #[test]
    fn steps_before_the_fault_do_not_count_after_it() {
        let mut restarts = Restarts::new();
        pause(&mut restarts);
        (0..599).for_each(|_| restarts.step());
        pause(&mut restarts);
        (0..599).for_each(|_| restarts.step());
        assert_eq!(pause(&mut restarts), 40);
    }
}
